/* The replay of a walk: draws what gaitval/reporting/replay.py computed, and links it with the curves.

   Axes are those of the data: x forward, y left, z up, m. Nothing is computed about the walk but the
   pose between two frames. The script fetches nothing, and without it the page shows six poses. */
"use strict";
(() => {
  const root = document.getElementById("replay");
  const source = document.getElementById("replay-scene");
  if (!root || !source) return;
  const find = (selector) => root.querySelector(selector);
  const original = root.cloneNode(true); // as it was written, for a page of its own
  const scripts = [...document.scripts].filter(({ type, text }) => !type && /THREE|walkerBody/.test(text));
  const player = find(".replay-player");
  const canvas = find("canvas");

  const fallBack = () => {
    player.hidden = true;
    find(".replay-message").hidden = false;
  };
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: !walkerBody.drawnSlowly() });
  if (!gl) return fallBack();

  // ---- data ---------------------------------------------------------------------------------

  const scene = JSON.parse(source.textContent);
  const TYPES = { int16: Int16Array, float32: Float32Array };

  function unpacked({ type, unit, data }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const numbers = new TYPES[type](bytes.buffer);
    return type === "float32" ? numbers : Float32Array.from(numbers, (number) => number * unit);
  }

  const [travel, force, pressure, cycle, stance, push] = ["travel", "force", "pressure", "cycle", "stance", "push"].map(
    (name) => unpacked(scene[name]),
  );
  const FRAMES = scene.frames;
  const LAST = FRAMES - 1;
  const RIGHT = 0;
  const SIDES = ["right", "left"];

  // ---- picture ------------------------------------------------------------------------------

  const VIEWS = {
    oblique: [1.0, -1.25, 0.42],
    front: [1, 0, 0.04],
    side: [0, -1, 0.04],
    left: [0, 1, 0.04],
    back: [-1, 0, 0.04],
    top: [-0.001, 0, 1],
  };
  const FIELD_OF_VIEW = 28;
  const FLOOR = { from: -1.9, to: 1.9, side: 1.4, square: 0.5 };
  const APART = 0.92; // m between the walk and the record side by side

  const renderer = new THREE.WebGLRenderer({ canvas, context: gl });
  renderer.debug.checkShaderErrors = false; // to ask would wait for every shader
  const world = new THREE.Scene();
  walkerBody.tilt(world, scene.body);
  const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1.6, 0.1, 40);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enablePan = orbit.enableZoom = false;
  orbit.maxPolarAngle = 0.5 * Math.PI;
  canvas.style.touchAction = "pan-y"; // a finger that moves up or down scrolls the page

  const { lit } = walkerBody;

  /* Three great circles. */
  function rings({ position, radius }) {
    const points = [];
    const COUNT = 20;
    const on = (axis, i) => {
      const [a, b] = [Math.cos, Math.sin].map((f) => radius * f((2 * Math.PI * i) / COUNT));
      return [[a, b, 0], [0, a, b], [b, 0, a]][axis].map((value, k) => value + position[k]);
    };
    for (let axis = 0; axis < 3; axis++) {
      for (let i = 0; i < COUNT; i++) points.push(...on(axis, i), ...on(axis, i + 1));
    }
    return points;
  }

  const overAll = (object, order) => {
    object.renderOrder = order;
    return object;
  };
  const see_through = { depthTest: false, depthWrite: false, transparent: true };
  const behind = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 }; // of what is at the same place
  const themed = {
    floor: new THREE.MeshBasicMaterial(),
    grid: new THREE.LineBasicMaterial(),
    force: new THREE.MeshBasicMaterial(see_through),
    push: new THREE.MeshBasicMaterial(see_through),
    record: lit({ ghost: 0.3, transparent: true, ...behind }),
    unknown: lit({ ghost: 0.1, transparent: true, ...behind }),
    ...Object.fromEntries(["right", "left", "body", "shorts", "face", "hair"].map((name) => [name, lit()])),
    spheres: new THREE.LineBasicMaterial(see_through),
  };
  const depthOnly = new THREE.MeshBasicMaterial({ colorWrite: false, ...behind });
  const ALIKE = { spheres: "record", unknown: "record" }; // that have another's colour
  const themeColour = (name) => new THREE.Color(getComputedStyle(root).getPropertyValue(`--replay-${name}`).trim());

  /* A group for every segment of a body, which `pose` moves. */
  function figureOf({ segments, origin, quaternion }) {
    const groups = segments.map(() => new THREE.Group());
    const whole = new THREE.Group();
    whole.add(...groups);
    world.add(whole);
    return { segments, groups, whole, origin: unpacked(origin), quaternion: unpacked(quaternion) };
  }

  const body = figureOf(scene.body);
  const recorded = figureOf(scene.recorded);
  const shown = { recorded: [recorded.whole], forces: [], spheres: [] };

  const group = (of, segment) => of.groups[of.segments.indexOf(segment)];
  const SIDE_PAINTS = { r: "right", l: "left" };
  for (const { segment, paint, geometry } of walkerBody(scene.body)) {
    group(body, segment).add(new THREE.Mesh(geometry, themed[SIDE_PAINTS[paint] ?? paint]));
  }
  for (const [index, segment] of body.segments.entries()) {
    const circles = scene.body.spheres.filter((sphere) => sphere.segment === segment).flatMap(rings);
    if (!circles.length) continue;
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", new THREE.Float32BufferAttribute(circles, 3));
    const sphere = overAll(new THREE.LineSegments(lines, themed.spheres), 3);
    body.groups[index].add(sphere);
    shown.spheres.push(sphere);
  }
  // The nearest skin of the record hides the skins behind it, so that no joint shows through.
  for (const { segment, geometry } of walkerBody(scene.recorded)) {
    const known = scene.recorded.known.includes(segment);
    group(recorded, segment).add(
      overAll(new THREE.Mesh(geometry, depthOnly), 1),
      overAll(new THREE.Mesh(geometry, known ? themed.record : themed.unknown), 2),
    );
  }

  const HEAD = 0.07; // m, tip of an arrow
  function arrowOf(paint, thick) {
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(thick, thick, 1, 12).rotateX(0.5 * Math.PI).translate(0, 0, 0.5), paint);
    const tip = new THREE.Mesh(new THREE.ConeGeometry(2.7 * thick, HEAD, 16).rotateX(0.5 * Math.PI).translate(0, 0, 0.5 * HEAD), paint);
    const group = new THREE.Group();
    const centre = new THREE.Mesh(new THREE.CircleGeometry(0.022, 16), paint);
    group.add(overAll(shaft, 4), overAll(tip, 4));
    body.whole.add(group, overAll(centre, 4));
    return { group, shaft, tip, centre };
  }
  const arrows = SIDES.map(() => arrowOf(themed.force, 0.011));
  const pushArrow = arrowOf(themed.push, 0.018);
  for (const { group, centre } of arrows) shown.forces.push(group, centre);
  pushArrow.centre.visible = false;

  /* Soft shadows on the floor, which the figures stand in. */
  const shade = new THREE.MeshBasicMaterial({ transparent: true, depthWrite: false, color: 0x000000 });
  shade.onBeforeCompile = (shader) => {
    shader.vertexShader = "varying vec2 spot;\n" + shader.vertexShader.replace("#include <begin_vertex>", "spot = uv;\n#include <begin_vertex>");
    shader.fragmentShader =
      "varying vec2 spot;\n" +
      shader.fragmentShader.replace("#include <opaque_fragment>", "diffuseColor.a *= 0.3 * pow(max(1.0 - 2.0 * length(spot - 0.5), 0.0), 1.5);\n#include <opaque_fragment>");
  };
  const shadows = [body, recorded].map(({ whole }) => {
    const shadow = new THREE.Mesh(new THREE.CircleGeometry(0.55, 32), shade);
    whole.add(shadow);
    return shadow;
  });

  const floor = new THREE.Mesh(new THREE.PlaneGeometry(FLOOR.to - FLOOR.from, 2 * FLOOR.side), themed.floor);
  const squares = new THREE.BufferGeometry();
  const grid = new THREE.LineSegments(squares, themed.grid);
  floor.position.set(0.5 * (FLOOR.to + FLOOR.from), 0, -0.001);
  const gridPoints = new Float32Array(6 * 16);
  squares.setAttribute("position", new THREE.BufferAttribute(gridPoints, 3));
  grid.frustumCulled = false;
  world.add(floor, grid);

  function moveGrid(forward, left) {
    let count = 0;
    const line = (...ends) => gridPoints.set(ends, 6 * count++);
    const first = (low, moved) => low + ((((-moved - low) % FLOOR.square) + FLOOR.square) % FLOOR.square);
    for (let x = first(FLOOR.from, forward); x <= FLOOR.to; x += FLOOR.square) line(x, -FLOOR.side, 0, x, FLOOR.side, 0);
    for (let y = first(-FLOOR.side, left); y <= FLOOR.side; y += FLOOR.square) line(FLOOR.from, y, 0, FLOOR.to, y, 0);
    squares.setDrawRange(0, 2 * count);
    squares.getAttribute("position").needsUpdate = true;
  }

  function paint() {
    renderer.setClearColor(themeColour("sky"));
    for (const [name, material] of Object.entries(themed)) material.color = themeColour(ALIKE[name] ?? name);
    draw();
  }

  // ---- pose ---------------------------------------------------------------------------------

  const state = { stride: 0, percent: 0, playing: false, touched: false, visible: true, view: "oblique", far: 1, wide: 1 };
  const first = new THREE.Quaternion();
  const second = new THREE.Quaternion();

  const between = (values, width, column, low, high, share) =>
    values[width * low + column] + share * (values[width * high + column] - values[width * low + column]);

  function place({ groups, origin, quaternion }, low, high, share) {
    const count = groups.length;
    groups.forEach((group, index) => {
      group.position.fromArray([0, 1, 2].map((axis) => between(origin, 3 * count, 3 * index + axis, low, high, share)));
      first.fromArray(quaternion, 4 * (count * low + index)).normalize();
      second.fromArray(quaternion, 4 * (count * high + index)).normalize();
      group.quaternion.slerpQuaternions(first, second, share);
    });
  }

  const UP = new THREE.Vector3(0, 0, 1);

  function pointAlong({ group, shaft, tip }, vector) {
    const length = scene.arrow * vector.length();
    group.visible = length > HEAD;
    if (!group.visible) return;
    group.quaternion.setFromUnitVectors(UP, vector.normalize());
    shaft.scale.z = length - HEAD;
    tip.position.z = length - HEAD;
  }

  function placeArrow(arrow, column, low, high, share) {
    const at = [0, 1].map((axis) => between(pressure, 4, 2 * column + axis, low, high, share));
    pointAlong(arrow, new THREE.Vector3(...[0, 1, 2].map((axis) => between(force, 6, 3 * column + axis, low, high, share))));
    arrow.group.visible = arrow.centre.visible = arrow.group.visible && at.every(Number.isFinite) && shows("forces");
    if (!arrow.group.visible) return;
    arrow.centre.position.set(...at, 0.001);
    arrow.group.position.set(...at, 0);
  }

  /* The arrow of a push ends at the pelvis, which it acts on. */
  function placePush(frame) {
    const vector = new THREE.Vector3(...[0, 1, 2].map((axis) => push[3 * frame + axis]));
    pointAlong(pushArrow, vector.clone());
    const pelvis = group(body, "pelvis").position;
    if (pushArrow.group.visible) pushArrow.group.position.copy(pelvis).addScaledVector(vector, -scene.arrow).add(new THREE.Vector3(0, 0, 0.08));
  }

  /* Side by side: half the distance to the right and to the left, as the picture is seen from. */
  const across = new THREE.Vector3();
  function placeApart() {
    const apart = shows("beside") && shows("recorded") ? 0.5 * APART : 0;
    across.setFromMatrixColumn(camera.matrixWorld, 0).setZ(0).normalize().multiplyScalar(apart);
    body.whole.position.copy(across);
    recorded.whole.position.copy(across).negate();
    [body, recorded].forEach((figure, i) => {
      const { x, y } = group(figure, "pelvis").position;
      shadows[i].position.set(x, y, 0.0005);
    });
    shadows[1].visible = apart > 0;
  }

  const shows = (name) => find(`[data-shows="${name}"]`).checked;

  /* The frames before and after the moment, and how far it is from the first to the second. */
  function frames() {
    const low = Math.min(Math.floor(state.percent), LAST);
    return [low, Math.min(low + 1, LAST), state.percent - low];
  }

  function pose() {
    const [low, high, share] = frames();
    const start = FRAMES * state.stride;
    place(body, start + low, start + high, share);
    place(recorded, low, high, share);
    arrows.forEach((arrow, column) => placeArrow(arrow, column, start + low, start + high, share));
    placePush(start + low);
    placeApart();
    moveGrid(...[0, 1].map((axis) => between(travel, 2, axis, start + low, start + high, share)));
  }

  // ---- words --------------------------------------------------------------------------------

  const nearest = () => FRAMES * state.stride + Math.round(state.percent);
  const onGround = (side) => Number.isFinite(stance[2 * nearest() + side]);

  function phaseName() {
    const [right, left] = SIDES.map((_, side) => onGround(side));
    if (right && left) return "double support";
    return right ? "right single support" : left ? "left single support" : "no foot on the ground";
  }

  /* The number of a stride, and the push on it. */
  function strideName(index) {
    const pushed = scene.pushes.find(({ first, end }) => index >= first && index < end);
    if (!pushed) return index + 1;
    const force = pushed.force.toFixed(2);
    return `${index - pushed.first + 1}, pushed by ${force} body weights, ${pushed.degrees}° from ahead`;
  }

  function words() {
    const left = cycle[2 * nearest() + 1];
    const percent = `Right ${state.percent.toFixed(0)} %` + (Number.isFinite(left) ? `, left ${left.toFixed(0)} %` : "");
    const seconds = ((state.percent / LAST) * scene.seconds[state.stride]).toFixed(2);
    return `${percent}; ${seconds} s of stride ${strideName(state.stride)}; ${phaseName()}`;
  }

  let told = "";
  function tell() {
    const text = words();
    if (text === told) return;
    find(".replay-phase").textContent = told = text;
    slider.value = state.percent;
    announce();
  }

  const QUIET = 4000; // ms between two announcements while the walk plays
  let said = "";
  let saidAt = -QUIET;

  /* For those who hear the page: at once while it stands still, now and then while it plays. */
  function announce() {
    const now = performance.now();
    const text = state.playing ? phaseName() : words();
    if (text === said || (state.playing && now - saidAt < QUIET)) return;
    find(".replay-live").textContent = said = text;
    saidAt = now;
  }

  // ---- curves -------------------------------------------------------------------------------

  const SVG = "http://www.w3.org/2000/svg";
  const LINKED = /-(cycle|stance)\.(right|left|both)\.\d+$/;
  const links = new Map(); // of every figure that was seen: what moves in it
  const seen = new Set(); // the figures in the window: to move what nobody sees would take half the time
  const within = (value, low, high) => Math.min(Math.max(value, low), high);

  function element(name, attributes, parent) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return parent.appendChild(made);
  }

  /* % of the curves' own axis now; NaN where it has none. */
  const own = (kind, side) => {
    if (kind !== "stance" && side === RIGHT) return state.percent;
    return (kind === "stance" ? stance : cycle)[2 * nearest() + side];
  };

  /* Go to the frame of this stride in which a foot is nearest to a per cent of its cycle or stance. */
  function goTo(kind, side, percent) {
    const values = kind === "stance" ? stance : cycle;
    let best = 0;
    let least = Infinity;
    for (let frame = 0; frame < FRAMES; frame++) {
      const distance = Math.abs(values[2 * (FRAMES * state.stride + frame) + side] - percent);
      if (distance < least) [best, least] = [frame, distance];
    }
    seek(best);
  }

  function clickable(group, box, moved) {
    const hit = element("rect", { ...box, class: "replay-hit" }, group);
    const inside = (event) =>
      new DOMPoint(event.clientX, event.clientY).matrixTransform(hit.getScreenCTM().inverse());
    hit.addEventListener("pointerdown", (event) => {
      hit.setPointerCapture(event.pointerId);
      moved(inside(event));
    });
    hit.addEventListener("pointermove", (event) => event.buttons && moved(inside(event)));
  }

  function linkCurve(group, kind, side) {
    const frame = group.querySelector('.frame, g[id*="-patch_"] > path');
    if (!frame) return;
    const { x, y, width, height } = frame.getBBox();
    const attributes = { y1: y, y2: y + height, class: `replay-cursor ${SIDES[side]}`, "vector-effect": "non-scaling-stroke" };
    const line = element("line", { ...attributes, "aria-hidden": "true" }, group);
    // of a panel with both sides the right one's cycle is followed
    const first = !group.querySelector(".replay-hit");
    if (first) clickable(group, { x, y, width, height }, (point) => goTo(kind, side, (100 * within(point.x - x, 0, width)) / width));
    links.get(group.closest("figure")).push(() => {
      const percent = own(kind, side);
      line.style.visibility = Number.isFinite(percent) && state.touched && shows("cursor") ? "" : "hidden";
      line.setAttribute("x1", x + (width * percent) / 100 || 0);
      line.setAttribute("x2", x + (width * percent) / 100 || 0);
    });
  }

  function linkFigure(figure) {
    links.set(figure, []);
    for (const group of figure.querySelectorAll("svg g[id]")) {
      const [, kind, sideName] = group.id.match(LINKED) ?? [];
      SIDES.forEach((name, side) => {
        if (!kind || (sideName !== name && sideName !== "both")) return;
        linkCurve(group, kind, side);
      });
    }
  }

  function linkCurves() {
    const watch = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        seen[isIntersecting ? "add" : "delete"](target);
        if (isIntersecting && !links.has(target)) linkFigure(target);
      }
      draw();
    });
    for (const figure of document.querySelectorAll("figure")) if (figure !== root) watch.observe(figure);
  }

  // ---- drawing ------------------------------------------------------------------------------

  const slider = find(".replay-slider input");
  let asked = 0;
  let before = null;
  let drawn = 0;

  const draw = () => {
    if (!asked) asked = requestAnimationFrame(tick);
  };

  function tick(now) {
    asked = 0;
    if (state.playing) {
      const passed = before === null ? 0 : now - before;
      advance(Math.min(passed, 250) / 1000);
      keepPace(passed);
      before = now;
      draw();
    }
    pose();
    seen.forEach((figure) => links.get(figure).forEach((update) => update()));
    tell();
    if (state.visible) {
      renderer.render(world, camera);
      root.dataset.frames = ++drawn;
      if (drawn === 1) requestAnimationFrame(markFirst);
    }
  }

  /* Where frames take too long, fewer pixels are drawn as long as it plays; a still picture has all. */
  const pace = { frames: 0, passed: 0, fine: 1 };
  function keepPace(passed) {
    pace.passed += passed;
    if (++pace.frames < 40) return;
    const slow = drawn > 60 && pace.passed / pace.frames > 33 && pace.fine > 0.6;
    pace.frames = pace.passed = 0;
    if (!slow) return;
    pace.fine *= 0.8;
    resize();
  }

  function markFirst() {
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits until it is drawn
    performance.mark("replay-first-frame");
  }

  function advance(seconds) {
    const speed = Number(find(".replay-speed").value);
    state.percent += (LAST * seconds * speed) / scene.seconds[state.stride];
    while (state.percent >= LAST) {
      state.percent -= LAST;
      next();
    }
  }

  /* The next stride: of the walk, or of the push that is played; a chosen stride stays. */
  function next() {
    if (find(".replay-stride").value === "all") state.stride = (state.stride + 1) % scene.walked;
    else if (state.stride >= scene.walked) {
      const { first, end } = scene.pushes.find((push) => state.stride < push.end);
      state.stride = state.stride + 1 < end ? state.stride + 1 : first;
      find(".replay-stride").value = state.stride;
    }
  }

  function play(on) {
    state.playing = on;
    before = null;
    find(".replay-play").textContent = on ? "Pause" : "Play";
    if (!on) slider.setAttribute("aria-valuetext", words());
    resize();
    announce();
    draw();
  }

  function seek(percent) {
    state.percent = within(Math.round(percent), 0, LAST);
    state.touched = true;
    play(false);
  }

  /* Curves show no cursor to those who only read them. */
  function touch() {
    if (state.touched) return;
    state.touched = true;
    draw();
  }

  function look(name) {
    state.view = name;
    for (const button of root.querySelectorAll("[data-view]")) button.setAttribute("aria-pressed", button.dataset.view === name);
    aim();
  }

  /* The whole walker is in the picture from every side, in wide pictures and in narrow ones. */
  const torso = scene.body.segments.indexOf("torso");
  const height = body.origin[3 * torso + 2] + 2.1 * scene.body.joints.upper_arm_r[2];
  const wideness = () => (shows("beside") ? 1.12 : 1);
  function aim() {
    const half = 0.5 * height + 0.12;
    state.wide = wideness();
    const distance = (state.wide * state.far * half) / Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180) / Math.min(1, camera.aspect);
    orbit.target.set(0, 0, 0.5 * height);
    camera.position.copy(orbit.target).addScaledVector(new THREE.Vector3(...VIEWS[state.view]).normalize(), distance);
    orbit.update();
    draw();
  }

  function turn(across, up) {
    const offset = camera.position.clone().sub(orbit.target).applyQuaternion(toY);
    const at = new THREE.Spherical().setFromVector3(offset);
    at.theta += across;
    at.phi = within(at.phi - up, 0.01, orbit.maxPolarAngle);
    camera.position.copy(orbit.target).add(offset.setFromSpherical(at).applyQuaternion(fromY));
    orbit.update();
    draw();
  }
  const toY = new THREE.Quaternion().setFromUnitVectors(camera.up, new THREE.Vector3(0, 1, 0));
  const fromY = toY.clone().invert();

  /* From a view that may have been turned by hand, which stays. */
  function stepBack(factor) {
    camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
    orbit.update();
    draw();
  }

  function zoom(factor) {
    const far = within(state.far * factor, 0.25, 3);
    stepBack(far / state.far);
    state.far = far;
  }

  function standApart() {
    stepBack(wideness() / state.wide);
    state.wide = wideness();
  }

  // ---- files --------------------------------------------------------------------------------

  function save(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  function savePicture() {
    pose();
    renderer.render(world, camera); // in the same task, or the picture would be empty
    canvas.toBlob((blob) => save(blob, "walk.png"), "image/png");
  }

  const VIDEO = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((type) => window.MediaRecorder?.isTypeSupported(type));
  const EVERY = 30; // frames a second of a video

  const wait = (ms) => new Promise((done) => setTimeout(done, ms));

  /* One stride, as it is seen, at the chosen speed: every picture is drawn, then asked for. */
  async function saveVideo({ target }) {
    const stream = canvas.captureStream(0);
    const [track] = stream.getVideoTracks();
    const recorder = new MediaRecorder(stream, { mimeType: VIDEO, videoBitsPerSecond: 6e6 });
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    const stopped = new Promise((done) => recorder.addEventListener("stop", done));
    target.disabled = true;
    play(false);
    const count = Math.ceil((EVERY * scene.seconds[state.stride]) / Number(find(".replay-speed").value));
    recorder.start();
    for (let picture = 0; picture <= count; picture++) {
      state.percent = (LAST * picture) / count;
      pose();
      tell();
      renderer.render(world, camera);
      track.requestFrame();
      await Promise.all([wait(1000 / EVERY), new Promise(requestAnimationFrame)]);
    }
    await wait(100); // for the last picture
    recorder.stop();
    await stopped;
    stream.getTracks().forEach((each) => each.stop());
    target.disabled = false;
    save(new Blob(parts, { type: VIDEO }), `walk.${VIDEO.slice(6).split(";")[0]}`);
  }

  /* The replay alone, for <iframe src="walk.html">: the same scripts, so the same policy lets them run. */
  function savePage() {
    const made = document.implementation.createHTMLDocument(document.title);
    made.documentElement.lang = document.documentElement.lang;
    for (const each of document.head.querySelectorAll("meta, style")) made.head.append(each.cloneNode(true));
    made.body.className = "replay-alone";
    made.body.append(original.cloneNode(true), source.cloneNode(true), ...scripts.map((each) => each.cloneNode(true)));
    save(new Blob(["<!doctype html>\n", made.documentElement.outerHTML], { type: "text/html" }), "walk.html");
  }

  // ---- controls -----------------------------------------------------------------------------

  function resize() {
    const { width, height } = find(".replay-stage").getBoundingClientRect();
    if (!width || !height) return;
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    // a still picture is drawn with more points than there are pixels, which smooths its edges
    renderer.setPixelRatio(state.playing ? Math.min(window.devicePixelRatio, 2) * pace.fine : 2);
    renderer.setSize(width, height, false);
    draw();
  }

  const STEP = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 };
  const TURN = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowDown: [0, -0.1], ArrowUp: [0, 0.1] };
  const LOOK = { 0: "oblique", 1: "front", 2: "side", 3: "top", 4: "left", 5: "back" };

  function onKey(event) {
    const { key, target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || target.matches("select")) return;
    const onCanvas = target === canvas;
    if (key === " " && (onCanvas || target === slider)) play(!state.playing);
    else if (event.shiftKey && TURN[key]) turn(...TURN[key]);
    else if (STEP[key] && target !== slider) seek(Math.round(state.percent) + STEP[key]);
    else if (key === "Home" && target !== slider) seek(0);
    else if (key === "End" && target !== slider) seek(LAST);
    else if (LOOK[key]) look(LOOK[key]);
    else if (key === "+" || key === "-") zoom(key === "+" ? 0.8 : 1.25);
    else return;
    event.preventDefault();
  }

  function listen() {
    root.addEventListener("keydown", onKey);
    player.addEventListener("pointerdown", touch);
    player.addEventListener("keydown", touch);
    find(".replay-play").addEventListener("click", () => play(!state.playing));
    slider.addEventListener("input", () => seek(Number(slider.value)));
    find(".replay-stride").addEventListener("change", (event) => {
      if (event.target.value !== "all") state.stride = Number(event.target.value);
      draw();
    });
    root.addEventListener("click", ({ target }) => {
      if (target.dataset.view) look(target.dataset.view);
      if (target.dataset.zoom) zoom(Number(target.dataset.zoom));
      if (target.dataset.saves === "picture") savePicture();
      if (target.dataset.saves === "page") savePage();
      if (target.dataset.saves === "video") saveVideo({ target });
    });
    root.addEventListener("change", ({ target }) => {
      const name = target.dataset.shows;
      shown[name]?.forEach((object) => (object.visible = target.checked));
      if (name === "beside") standApart();
      draw();
    });
    orbit.addEventListener("change", draw);
    new ResizeObserver(resize).observe(find(".replay-stage"));
    new IntersectionObserver(([entry]) => {
      state.visible = entry.isIntersecting;
      draw();
    }).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
    matchMedia("(prefers-reduced-motion: reduce)").addEventListener("change", ({ matches }) => matches && play(false));
    canvas.addEventListener("webglcontextlost", () => {
      play(false);
      fallBack();
    });
  }

  scene.seconds.forEach((seconds, index) => {
    const seen = index < scene.walked ? ` (${seconds.toFixed(2)} s)` : "";
    find(".replay-stride").add(new Option(strideName(index) + seen, index));
  });
  player.hidden = false;
  find('[data-saves="video"]').hidden = !VIDEO || !canvas.captureStream;
  shown.spheres.forEach((object) => (object.visible = shows("spheres")));
  resize();
  look("oblique");
  paint();
  listen();
  play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", linkCurves);
  else linkCurves();

  /* For tests: go to a frame of a stride, and where a segment's joint is drawn, m. */
  root.replay = {
    go: (stride, percent) => {
      state.stride = stride;
      seek(percent);
      pose();
    },
    joint: (segment, of = "body") => {
      const figure = of === "body" ? body : recorded;
      return figure.groups[figure.segments.indexOf(segment)].position.toArray();
    },
  };
})();
