/* The page of a live walk: draws what gaitval/apps/live/pictures.py sends, and sends what is done.

   Axes are those of the data: x forward, y left, z up, m. Nothing of the walk is computed here. */
"use strict";
(async () => {
  const find = (selector) => document.querySelector(selector);
  const root = find("#live");
  const canvas = find("canvas");
  const gone = (text) => {
    find("#gone").textContent = text;
    find("#gone").hidden = false;
  };

  const gl = canvas.getContext("webgl2", { alpha: false, antialias: !walkerBody.drawnSlowly() });
  if (!gl) return gone("This browser shows no three-dimensional graphics (WebGL 2), so there is no walk to see.");
  const answer = await fetch("scene").catch(() => null);
  if (!answer?.ok) return gone("The program that walks does not answer. Start gaitval live again.");
  const scene = await answer.json();

  // ---- the picture ----------------------------------------------------------------------------

  const PAINTS = { r: "right", l: "left" };
  const VIEWS = { oblique: [1.0, -1.25, 0.42], front: [1, 0, 0.06], side: [0, -1, 0.06], top: [-0.001, 0, 1] };
  const FIELD_OF_VIEW = 28;
  const SQUARE = 0.5; // m, of the floor
  const REACH = 3; // m, of the floor to every side
  const UP = new THREE.Vector3(0, 0, 1);

  const renderer = new THREE.WebGLRenderer({ canvas, context: gl });
  renderer.debug.checkShaderErrors = false; // to ask would wait for every shader
  const world = new THREE.Scene();
  walkerBody.tilt(world, scene.body);
  const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1.6, 0.1, 60);
  camera.up.copy(UP);
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enablePan = false;
  orbit.maxPolarAngle = 0.5 * Math.PI;
  orbit.minDistance = 1;
  orbit.maxDistance = 15;

  const colour = (name) => new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  const onTop = { depthTest: false, depthWrite: false, transparent: true };
  const themed = {
    floor: new THREE.MeshBasicMaterial(),
    grid: new THREE.LineBasicMaterial(),
    ground: new THREE.MeshBasicMaterial(onTop),
    push: new THREE.MeshBasicMaterial(onTop),
    ...Object.fromEntries(["right", "left", "body", "shorts", "face", "hair", "device"].map((name) => [name, walkerBody.lit()])),
  };

  /* The person, as the replay of a report has it, and the devices. */
  const middleOf = (geometry) => {
    geometry.computeBoundingSphere();
    return geometry.boundingSphere.center.clone();
  };
  const limbs = scene.segments.map((segment) => {
    const group = new THREE.Group();
    world.add(group);
    return { segment, group, centres: [] };
  });
  const limbOf = (segment) => limbs[scene.segments.indexOf(segment)];
  const devices = [];
  const lost = scene.shapes.filter(({ kind }) => kind === "skin").map(({ segment }) => segment);
  for (const { segment, paint, geometry } of walkerBody(scene.body)) {
    const own = themed[PAINTS[paint] ?? paint];
    const mesh = new THREE.Mesh(geometry, own);
    if (lost.includes(segment)) devices.push({ mesh, worn: themed.device, bare: own });
    limbOf(segment).group.add(mesh);
    limbOf(segment).centres.push(middleOf(geometry));
  }
  for (const shape of scene.shapes.filter(({ kind }) => kind !== "skin")) {
    const mesh = new THREE.Mesh(walkerBody.solid(shape), themed.device);
    devices.push({ mesh, worn: themed.device, bare: null });
    limbOf(shape.segment).group.add(mesh);
  }
  function wear(worn) {
    for (const { mesh, worn: on, bare } of devices) {
      mesh.visible = Boolean(worn || bare);
      mesh.material = worn ? on : (bare ?? on);
    }
  }

  const HEAD = 0.07; // m, tip of an arrow
  function arrowOf(material, order, thick = 1) {
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.011 * thick, 0.011 * thick, 1, 8).rotateX(0.5 * Math.PI).translate(0, 0, 0.5), material);
    const tip = new THREE.Mesh(new THREE.ConeGeometry(0.03 * thick, HEAD, 12).rotateX(0.5 * Math.PI).translate(0, 0, 0.5 * HEAD), material);
    const group = new THREE.Group();
    for (const part of [shaft, tip]) {
      part.renderOrder = order;
      group.add(part);
    }
    world.add(group);
    return { group, shaft, tip };
  }
  function point(arrow, from, along) {
    const length = along.length();
    arrow.group.visible = length > HEAD;
    if (!arrow.group.visible) return;
    arrow.group.position.copy(from);
    arrow.group.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    arrow.shaft.scale.z = length - HEAD;
    arrow.tip.position.z = length - HEAD;
  }
  const grounds = [0, 1].map(() => arrowOf(themed.ground, 4));
  const pusher = arrowOf(themed.push, 5, 1.7);
  pusher.group.visible = false;

  const floor = new THREE.Mesh(new THREE.PlaneGeometry(2 * REACH, 2 * REACH), themed.floor);
  const LINES = 2 * (2 * Math.ceil(REACH / SQUARE) + 1);
  const gridPoints = new Float32Array(6 * LINES);
  const squares = new THREE.BufferGeometry();
  squares.setAttribute("position", new THREE.BufferAttribute(gridPoints, 3));
  const grid = new THREE.LineSegments(squares, themed.grid);
  grid.frustumCulled = false;
  world.add(floor, grid);
  function layFloor(x, y) {
    floor.position.set(x, y, -0.002);
    let count = 0;
    const line = (...ends) => gridPoints.set(ends, 6 * count++);
    for (let at = Math.ceil((x - REACH) / SQUARE) * SQUARE; at <= x + REACH; at += SQUARE) line(at, y - REACH, 0, at, y + REACH, 0);
    for (let at = Math.ceil((y - REACH) / SQUARE) * SQUARE; at <= y + REACH; at += SQUARE) line(x - REACH, at, 0, x + REACH, at, 0);
    squares.setDrawRange(0, 2 * count);
    squares.getAttribute("position").needsUpdate = true;
  }

  function paint() {
    renderer.setClearColor(colour("sky"));
    for (const [name, material] of Object.entries(themed)) material.color = colour(name);
    draw();
  }

  // ---- the walk -------------------------------------------------------------------------------

  /* A message of gaitval/apps/live/pictures.py. */
  function read(doubles) {
    let at = 0;
    const take = (count) => doubles.subarray(at, (at += count));
    const numbers = Object.fromEntries(scene.numbers.map((name) => [name, take(1)[0]]));
    return {
      ...numbers,
      mu: take(scene.parameters.length),
      push: take(2),
      force: take(6),
      pressure: take(4),
      origin: take(3 * scene.segments.length),
      quaternion: take(4 * scene.segments.length),
    };
  }

  async function watch(take) {
    const reader = (await fetch("walk")).body.getReader();
    let rest = new Uint8Array(0);
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      const data = new Uint8Array(rest.length + value.length);
      data.set(rest);
      data.set(value, rest.length);
      let at = 0;
      while (data.length >= at + 4) {
        const size = new DataView(data.buffer, at).getUint32(0, true);
        if (data.length < at + 4 + size) break;
        take(read(new Float64Array(data.slice(at + 4, at + 4 + size).buffer)));
        at += 4 + size;
      }
      rest = data.slice(at);
    }
  }

  const NEWTON = 0.0022; // m of arrow for a N of push
  const pelvis = new THREE.Vector3();
  const ghost = { along: new THREE.Vector3(), until: 0, pushes: null }; // a push that has acted is seen for a while
  let now = null;
  let before = null;
  const first = new THREE.Quaternion();
  const second = new THREE.Quaternion();

  /* In slow motion there is less than a picture's time between two moments: it is between them. */
  function shareAt(time) {
    if (!before || now.rate >= 0.5 || now.step === before.step) return 1;
    return Math.min(1, (time - now.came) / Math.max(now.came - before.came, 1));
  }

  function pose(time) {
    const share = shareAt(time);
    const from = share < 1 ? before : now;
    limbs.forEach(({ group }, i) => {
      for (const axis of ["x", "y", "z"]) {
        const k = 3 * i + "xyz".indexOf(axis);
        group.position[axis] = from.origin[k] + share * (now.origin[k] - from.origin[k]);
      }
      first.fromArray(from.quaternion, 4 * i);
      second.fromArray(now.quaternion, 4 * i);
      group.quaternion.slerpQuaternions(first, second, share);
    });
    pelvis.copy(limbs[0].group.position);
    wear(now.worn);
    grounds.forEach((arrow, side) => {
      const along = new THREE.Vector3(...now.force.subarray(3 * side, 3 * side + 3)).multiplyScalar(scene.arrow);
      const [x, y] = now.pressure.subarray(2 * side, 2 * side + 2);
      if (Number.isFinite(x)) point(arrow, new THREE.Vector3(x, y, 0), along);
      else arrow.group.visible = false;
    });
    ghost.pushes ??= now.pushes;
    if (now.pushes !== ghost.pushes) {
      ghost.pushes = now.pushes;
      ghost.along.set(now.push[0], now.push[1], 0).multiplyScalar(NEWTON);
      ghost.until = time + 500;
    }
    if (drag) aimPush();
    else if (time < ghost.until) point(pusher, pelvis.clone().sub(ghost.along), ghost.along);
    else pusher.group.visible = false;
    follow();
  }

  /* The camera walks beside the person. */
  const target = new THREE.Vector3();
  function follow() {
    const step = world.localToWorld(new THREE.Vector3(pelvis.x, pelvis.y, 0.84)).sub(target);
    target.add(step);
    orbit.target.add(step);
    camera.position.add(step);
    layFloor(pelvis.x, pelvis.y);
  }

  const height = 1.95; // m of the picture, with a margin over the tallest
  function look(name) {
    const distance = (0.5 * height + 0.15) / Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180) / Math.min(1, camera.aspect);
    orbit.target.copy(target);
    camera.position.copy(target).addScaledVector(new THREE.Vector3(...VIEWS[name]).normalize(), distance);
    orbit.update();
    draw();
  }

  // ---- drawing --------------------------------------------------------------------------------

  let asked = 0;
  let drawn = 0;
  let drawnStep = -1;
  const draw = () => {
    if (!asked) asked = requestAnimationFrame(tick);
  };
  function tick(time) {
    asked = 0;
    if (!now) return;
    pose(time);
    renderer.render(world, camera);
    keepPace(time);
    if (now.step !== drawnStep) root.dataset.frames = ++drawn; // pictures of another moment
    root.dataset.worn = now.worn;
    drawnStep = now.step;
    tell(time);
    if (time < ghost.until || shareAt(time) < 1) draw();
  }

  /* Where pictures take too long, they have fewer pixels; a still picture has all. */
  const pace = { frames: 0, since: 0, fine: 1 };
  function keepPace(time) {
    if (++pace.frames < 40) return;
    const slow = now.rate === 1 && (time - pace.since) / pace.frames > 26 && pace.fine > 0.5;
    const begun = pace.since > 0;
    pace.frames = 0;
    pace.since = time;
    if (!slow || !begun) return;
    pace.fine *= 0.8;
    resize();
  }
  function resize() {
    const { width, height } = find(".stage").getBoundingClientRect();
    if (!width || !height) return;
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2) * (now?.rate > 0 ? pace.fine : 1));
    renderer.setSize(width, height, false);
    draw();
  }

  // ---- words ----------------------------------------------------------------------------------

  const set = (selector, text) => {
    const element = find(selector);
    if (element.textContent !== text) element.textContent = text;
  };
  const measured = { time: 0, walked: 0, x: 0, rate: NaN, speed: NaN, stride: NaN, cycles: 0 };
  let told = 0;

  function tell(time) {
    if (time - told < 250) return;
    told = time;
    const seconds = (time - measured.time) / 1000;
    const walked = now.time - measured.walked;
    if (seconds > 1) {
      const cycles = now.cycles - measured.cycles;
      if (walked > 0 && cycles > 0) {
        measured.rate = walked / seconds;
        measured.speed = (limbs[0].group.position.x - measured.x) / walked;
        measured.stride = walked / cycles;
      }
      Object.assign(measured, { time, walked: now.time, x: limbs[0].group.position.x, cycles: now.cycles });
    }
    const figure = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
    set("#speed-now", figure(measured.speed, 2));
    set("#stride-now", figure(measured.stride, 2));
    set("#time-now", figure(now.time, 0));
    set("#rate-now", figure(now.rate === 0 ? 0 : measured.rate, 2));
  }

  const say = (text, fell = false) => {
    set("#news", text);
    find("#news").className = fell ? "fell" : "";
    find("#hint").hidden = true; // on a narrow page it is where the news are, and who pushes has read it
  };
  let push = null; // the last one: when it acted, and what is said of it
  const nameOf = (forward, left) => {
    const words = [];
    const size = Math.hypot(forward, left);
    if (Math.abs(forward) > 0.38 * size) words.push(forward > 0 ? "forward" : "back");
    if (Math.abs(left) > 0.38 * size) words.push(left > 0 ? "to the left" : "to the right");
    return words.join(" and ");
  };

  /* What happened between two moments, in words. */
  function happened() {
    const [forward, left] = now.push;
    if (now.pushes !== before.pushes && Math.hypot(forward, left) > 0) {
      const size = Math.hypot(forward, left).toFixed(0);
      const name = `${size} N ${nameOf(forward, left)}`;
      push = { cycles: now.cycles, time: now.time, text: `a push of ${name}`, said: false };
      say(`Push: ${name}, at ${(100 * now.phase).toFixed(0)} % of the right gait cycle.`);
    }
    if (now.down && !before.down) {
      const cause = push && now.cycles - push.cycles < 5 ? ` ${(now.time - push.time).toFixed(1)} s after ${push.text}` : "";
      say(`It fell${cause}, and stands up again.`, true);
      push = null;
    } else if (push && !push.said && now.cycles - push.cycles >= 5) {
      push.said = true;
      say(`Survived: five cycles after ${push.text}.`);
    }
    if (now.over && !before.over) {
      const equal = now.over === 1;
      say(equal ? "The log is over; all of it was equal, bit for bit." : "The log is over; it was not equal to it.", !equal);
    }
  }

  // ---- what is done ---------------------------------------------------------------------------

  const sent = []; // pushes under way: their number and when they were sent
  root.dataset.delays = "";
  async function act(values) {
    const response = await fetch("do", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(values),
    }).catch(() => null);
    if (!response?.ok) say("That could not be done.", true);
  }
  let pushes = null;
  function give(forward, left) {
    if (scene.replay) return;
    pushes = Math.max(pushes ?? 0, now.pushes) + 1;
    sent.push({ number: pushes, at: performance.now() });
    act({ do: "push", forward, left });
  }
  /* For tests: ms from the end of a drag until a picture after the push is drawn. */
  function arrived() {
    while (sent.length && now.pushes >= sent[0].number) {
      const { at } = sent.shift();
      requestAnimationFrame(() => {
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits until it is drawn
        root.dataset.delays += `${(performance.now() - at).toFixed(1)} `;
      });
    }
  }

  // Dragging on the body pushes it.
  const NEWTONS = 2.5; // for a pixel
  const HOLD = 0.16; // m around a segment's middle
  let drag = null;
  const middle = new THREE.Vector3();
  function onBody(x, y) {
    const { width, height } = canvas.getBoundingClientRect();
    const scale = height / (2 * Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180)) / camera.position.distanceTo(target);
    return limbs.some(({ group, centres }) =>
      centres.some((centre) => {
        middle.copy(centre).applyQuaternion(group.quaternion).add(group.position).project(camera);
        const [px, py] = [(0.5 + 0.5 * middle.x) * width, (0.5 - 0.5 * middle.y) * height];
        return Math.hypot(px - x, py - y) < HOLD * scale;
      }),
    );
  }
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  /* N forward and left of a drag: to the right of the picture is to the right of the camera, up is away from it. */
  function pushOf({ from, to }) {
    const away = target.clone().sub(camera.position).setZ(0);
    if (away.length() < 1e-3) away.set(1, 0, 0);
    away.normalize();
    const [right, up] = [to[0] - from[0], from[1] - to[1]];
    let forward = NEWTONS * (right * away.y + up * away.x);
    let left = NEWTONS * (-right * away.x + up * away.y);
    const share = Math.min(1, scene.largest_push / Math.max(Math.hypot(forward, left), 1e-9));
    return [share * forward, share * left];
  }
  function aimPush() {
    const [forward, left] = pushOf(drag);
    const along = new THREE.Vector3(forward, left, 0).multiplyScalar(NEWTON);
    point(pusher, pelvis.clone().sub(along), along);
    const label = find("#force");
    label.hidden = false;
    label.textContent = `${Math.hypot(forward, left).toFixed(0)} N ${nameOf(forward, left)}`;
    label.style.transform = `translate(${drag.to[0] + 14}px, ${drag.to[1] - 14}px)`;
  }
  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (scene.replay || event.button !== 0 || !now || now.down || !onBody(...at(event))) return;
      event.stopImmediatePropagation(); // the view is not turned
      canvas.setPointerCapture(event.pointerId);
      drag = { from: at(event), to: at(event) };
    },
    true,
  );
  canvas.addEventListener("pointermove", (event) => {
    if (drag) {
      drag.to = at(event);
      draw();
    } else if (now && !scene.replay) canvas.classList.toggle("pushes", onBody(...at(event)));
  });
  const release = (gives) => () => {
    if (!drag) return;
    const values = pushOf(drag);
    drag = null;
    find("#force").hidden = true;
    if (gives && Math.hypot(...values) > 10) give(...values);
    draw();
  };
  canvas.addEventListener("pointerup", release(true));
  canvas.addEventListener("pointercancel", release(false));

  // Buttons, sliders and keys.
  const pauseButton = find("#pause");
  const going = () => now && now.rate > 0;
  const clock = (on) => act({ do: "clock", rate: on ? Number(find("#rate").value) : 0 });
  pauseButton.addEventListener("click", () => clock(!going()));
  find("#rate").addEventListener("change", () => clock(true));
  find("#restart").addEventListener("click", () => act({ do: "restart" }));

  /* At most one message of a slider at a time: the last value counts. */
  function sender(values) {
    let busy = false;
    let next = null;
    return async (value) => {
      next = value;
      if (busy) return;
      busy = true;
      while (next !== null) {
        const last = next;
        next = null;
        await act(values(last));
      }
      busy = false;
    };
  }
  const speed = find("#speed");
  /* What a slider is at, beside it and for a screen reader, which else says a number without a unit. */
  function showAt(input, output, text) {
    output.textContent = text;
    input.ariaValueText = text;
  }
  const showSpeed = () => showAt(speed, find("#speed-wanted"), `${Number(speed.value).toFixed(2)} m/s`);
  const sendSpeed = sender((value) => ({ do: "speed", value }));
  Object.assign(speed, { min: scene.speed.lowest.toFixed(2), max: scene.speed.highest.toFixed(2) });
  set(
    "#speed-ends",
    `${scene.speed.lowest.toFixed(2)} to ${scene.speed.highest.toFixed(2)} m/s can be predicted; recorded at ` +
      `${scene.recorded.map((value) => value.toFixed(2)).join(", ")} m/s.`,
  );
  /* What somebody moves is sent, and shown on every page: a slider goes to where another page has
     it, but not under the hand that moves it, whose own values come back late. */
  const OWN = 500; // ms
  function followed(input, show, send) {
    let moved = -OWN;
    let last = null;
    input.addEventListener("input", () => {
      moved = performance.now();
      last = null; // or a value that another page has set back within this time would look known
      show();
      send(Number(input.value));
    });
    return (value) => {
      if (value === last || performance.now() - moved < OWN) return;
      last = value;
      input.value = value;
      show();
    };
  }
  const followSpeed = followed(speed, showSpeed, sendSpeed);

  const worn = find("#worn");
  find("#device").hidden = scene.devices.length === 0;
  set("#device-name", scene.devices.join(", "));
  worn.addEventListener("change", () => act({ do: "device", on: worn.checked }));

  const size = find("#size");
  const showSize = () => showAt(size, find("#size-now"), `${size.value} N`);
  size.addEventListener("input", showSize);
  showSize();
  const pushBy = (forward, left) => now && give(forward * Number(size.value), left * Number(size.value));
  for (const button of document.querySelectorAll("[data-push]")) {
    button.addEventListener("click", () => pushBy(...button.dataset.push.split(" ").map(Number)));
  }

  /* A slip or a trip is told of when it is asked for; its foot is at the place within a stride. */
  for (const button of document.querySelectorAll("[data-ground]")) {
    button.addEventListener("click", () => {
      if (!now || now.down) return;
      const [kind, side] = button.dataset.ground.split(" ");
      push = { cycles: now.cycles, time: now.time, text: `a ${kind} of the ${side} foot was asked for`, said: false };
      say(kind === "slip" ? `The ${side} foot slips where it lands next.` : `The ${side} foot is stopped in its next swing.`);
      act({ do: kind, side });
    });
  }

  const LABELS = {
    damping: ["joint damping", 1, 2, "Nms/rad"],
    friction: ["friction of the ground", 1, 2, ""],
    foot_length: ["foot length", 100, 1, "%"],
    shank_length: ["shank length", 100, 1, "%"],
    thigh_length: ["thigh length", 100, 1, "%"],
  };
  const AXES = { x: "forward", y: "outward", z: "up" };
  function labelOf(name) {
    if (LABELS[name]) return LABELS[name];
    const [joint, axis] = name.split("_");
    return [`${joint} ${AXES[axis]}`, 1000, 1, "mm"];
  }
  const dials = scene.parameters.map((parameter) => {
    const [text, factor, digits, unit] = labelOf(parameter.name);
    const row = document.createElement("div");
    row.className = "slider";
    const id = `mu-${parameter.name}`;
    const label = Object.assign(document.createElement("label"), { htmlFor: id, textContent: text });
    const value = Object.assign(document.createElement("output"), { htmlFor: id });
    const input = Object.assign(document.createElement("input"), { type: "range", id, step: "any" });
    Object.assign(input, { min: parameter.lowest, max: parameter.highest });
    const show = () => showAt(input, value, `${(factor * Number(input.value)).toFixed(digits)} ${unit}`.replace(/^-(0\.0*) /, "$1 "));
    const send = sender((wanted) => ({ do: "body", name: parameter.name, value: wanted }));
    row.append(label, value, input);
    find("#parameters").append(row);
    return { input, parameter, follow: followed(input, show, send) };
  });
  find("#nominal").addEventListener("click", () => {
    for (const { input, parameter } of dials) {
      if (Number(input.value) === parameter.nominal) continue;
      input.value = parameter.nominal;
      input.dispatchEvent(new Event("input"));
    }
  });

  const PUSHES = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
  const LOOK = { 0: "oblique", 1: "front", 2: "side", 3: "top" };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === " ") clock(!going());
    else if (PUSHES[event.key]) pushBy(...PUSHES[event.key]);
    else if (LOOK[event.key]) look(LOOK[event.key]);
    else return;
    event.preventDefault();
  });

  // ---- begin ----------------------------------------------------------------------------------

  set("#who", scene.subject);
  if (scene.replay) {
    set("#kind", "walks again what is in the log");
    find("#hint").hidden = true;
    for (const part of document.querySelectorAll(".acts")) part.hidden = true;
  }
  orbit.addEventListener("change", draw);
  new ResizeObserver(resize).observe(find(".stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  canvas.addEventListener("webglcontextlost", () => gone("The graphics of this browser have ended. Load the page again."));
  resize();
  paint();
  look("oblique");

  await watch((moment) => {
    moment.came = performance.now();
    const begins = now === null;
    followSpeed(moment.speed);
    dials.forEach(({ follow }, i) => follow(moment.mu[i]));
    // A person who starts again while the clock stands makes no step.
    if (!begins && ["step", "time", "rate", "worn"].every((name) => moment[name] === now[name])) return;
    before = now;
    now = moment;
    if (!begins) happened();
    if (before?.rate !== now.rate && now.rate > 0) find("#rate").value = now.rate;
    if (before?.worn !== now.worn) worn.checked = now.worn === 1;
    if (before?.rate !== now.rate && pace.fine < 1) resize();
    const text = now.rate > 0 ? "Pause" : "Go on";
    if (pauseButton.textContent !== text) pauseButton.textContent = text;
    arrived();
    draw();
  }).catch(() => {});
  gone("The walk has ended, or the program that walks was stopped. What was done is in its log.");
})();
