/* The replay of a walk: draws what gaitval/reporting/replay.py computed, and links it with the curves.

   Axes are those of the data: x forward, y left, z up, m. Nothing is computed about the walk but the
   pose between two frames. The script fetches nothing, and without it the page shows six poses. */
"use strict";
(() => {
  const root = document.getElementById("replay");
  const source = document.getElementById("replay-scene");
  if (!root || !source) return;
  const find = (selector) => root.querySelector(selector);
  const player = find(".replay-player");
  const canvas = find("canvas");

  const fallBack = () => {
    player.hidden = true;
    find(".replay-message").hidden = false;
  };
  // Edges are not smoothed: without a graphics card that costs more than all else (measured by
  // evidence/report/replay.py).
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
  if (!gl) return fallBack();

  // ---- data ---------------------------------------------------------------------------------

  const scene = JSON.parse(source.textContent);
  const says = JSON.parse(root.dataset.words); // in the language of the page
  const figure = (number) => number.toFixed(2).replace(".", says.point);
  const TYPES = { int16: Int16Array, float32: Float32Array };

  function unpacked({ type, unit, data }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const numbers = new TYPES[type](bytes.buffer);
    return type === "float32" ? numbers : Float32Array.from(numbers, (number) => number * unit);
  }

  const [travel, force, pressure, cycle, stance] = ["travel", "force", "pressure", "cycle", "stance"].map(
    (name) => unpacked(scene[name]),
  );
  const FRAMES = scene.frames;
  const LAST = FRAMES - 1;
  const RIGHT = 0;
  const SIDES = ["right", "left"];

  // ---- picture ------------------------------------------------------------------------------

  const PAINTS = { r: "right", l: "left", "": "body" };
  const VIEWS = {
    oblique: [1.0, -1.25, 0.42],
    front: [1, 0, 0.04],
    side: [0, -1, 0.04],
    top: [-0.001, 0, 1],
  };
  const FIELD_OF_VIEW = 28;
  const FLOOR = { from: -1.9, to: 1.9, side: 0.9, square: 0.5 };
  const LIGHT = new THREE.Vector3(0.4, -0.45, 0.8).normalize();

  const renderer = new THREE.WebGLRenderer({ canvas, context: gl });
  renderer.debug.checkShaderErrors = false; // to ask would wait for every shader
  const world = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1.6, 0.1, 40);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enablePan = orbit.enableZoom = false;
  orbit.maxPolarAngle = 0.5 * Math.PI;
  canvas.style.touchAction = "pan-y"; // a finger that moves up or down scrolls the page

  const sideOf = (segment) => (segment.endsWith("_r") || segment.endsWith("_l") ? segment.slice(-1) : "");

  /* Light is painted on, from above in the segment's own frame: lamps would cost time at every pixel. */
  function shade(geometry, colour) {
    const normals = geometry.getAttribute("normal");
    const colours = new Float32Array(3 * normals.count);
    const normal = new THREE.Vector3();
    for (let i = 0; i < normals.count; i++) {
      const bright = 0.8 + 0.2 * normal.fromBufferAttribute(normals, i).dot(LIGHT);
      colours.set([bright * colour.r, bright * colour.g, bright * colour.b], 3 * i);
    }
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  }

  function solid({ kind, position, size }) {
    const made = {
      box: () => new THREE.BoxGeometry(...size),
      sphere: () => new THREE.SphereGeometry(size[0], 12, 7),
      cylinder: () => new THREE.CylinderGeometry(size[0], size[0], size[1], 12, 1, true).rotateX(0.5 * Math.PI),
    }[kind]();
    return made.translate(...position);
  }

  function stick({ from, to }) {
    const start = new THREE.Vector3(...from);
    const along = new THREE.Vector3(...to).sub(start);
    const length = along.length();
    const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.normalize());
    const bar = new THREE.CylinderGeometry(0.008, 0.008, length, 6).translate(0, 0.5 * length, 0);
    const ends = [0, length].map((at) => new THREE.SphereGeometry(0.015, 8, 6).translate(0, at, 0));
    return THREE.mergeGeometries([bar, ...ends]).applyQuaternion(turn).translate(...from);
  }

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
  const themed = {
    floor: new THREE.MeshBasicMaterial(),
    grid: new THREE.LineBasicMaterial(),
    record: new THREE.MeshBasicMaterial({ ...see_through, opacity: 0.85 }),
    force: new THREE.MeshBasicMaterial(see_through),
    spheres: new THREE.LineBasicMaterial(see_through),
  };
  const painted = new THREE.MeshBasicMaterial({ vertexColors: true });
  const themeColour = (name) => new THREE.Color(getComputedStyle(root).getPropertyValue(`--replay-${name}`).trim());

  /* A group for every segment of a body, which `pose` moves. */
  function figureOf({ segments, origin, quaternion }) {
    const groups = segments.map(() => new THREE.Group());
    world.add(...groups);
    return { segments, groups, origin: unpacked(origin), quaternion: unpacked(quaternion) };
  }

  const body = figureOf(scene.body);
  const recorded = figureOf(scene.recorded);
  const shown = { recorded: recorded.groups, forces: [], spheres: [] };
  const limbs = []; // geometry and name of its colour

  body.segments.forEach((segment, index) => {
    const solids = scene.shapes.filter((shape) => shape.segment === segment).map(solid);
    const mesh = new THREE.Mesh(THREE.mergeGeometries(solids), painted);
    limbs.push([mesh.geometry, PAINTS[sideOf(segment)]]);
    body.groups[index].add(mesh);
    const circles = scene.spheres.filter((sphere) => sphere.segment === segment).flatMap(rings);
    if (!circles.length) return;
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", new THREE.Float32BufferAttribute(circles, 3));
    const sphere = overAll(new THREE.LineSegments(lines, themed.spheres), 3);
    body.groups[index].add(sphere);
    shown.spheres.push(sphere);
  });
  recorded.segments.forEach((segment, index) => {
    const bars = scene.sticks.filter((each) => each.segment === segment).map(stick);
    recorded.groups[index].add(overAll(new THREE.Mesh(THREE.mergeGeometries(bars), themed.record), 2));
  });

  const HEAD = 0.07; // m, tip of an arrow
  const arrows = SIDES.map(() => {
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.011, 0.011, 1, 8).rotateX(0.5 * Math.PI).translate(0, 0, 0.5), themed.force);
    const tip = new THREE.Mesh(new THREE.ConeGeometry(0.03, HEAD, 10).rotateX(0.5 * Math.PI).translate(0, 0, 0.5 * HEAD), themed.force);
    const group = new THREE.Group();
    const centre = new THREE.Mesh(new THREE.CircleGeometry(0.022, 16), themed.force);
    group.add(overAll(shaft, 4), overAll(tip, 4));
    world.add(group, overAll(centre, 4));
    shown.forces.push(group, centre);
    return { group, shaft, tip, centre };
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
    for (const name of ["floor", "grid", "record", "force"]) themed[name].color = themeColour(name);
    themed.spheres.color = themeColour("record");
    for (const [geometry, name] of limbs) shade(geometry, themeColour(name));
    draw();
  }

  // ---- pose ---------------------------------------------------------------------------------

  const state = { stride: 0, percent: 0, playing: false, visible: true, view: "oblique", far: 1 };
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

  function placeArrow(arrow, column, low, high, share) {
    const push = new THREE.Vector3(...[0, 1, 2].map((axis) => between(force, 6, 3 * column + axis, low, high, share)));
    const at = [0, 1].map((axis) => between(pressure, 4, 2 * column + axis, low, high, share));
    const length = scene.arrow * push.length();
    const loaded = length > HEAD && at.every(Number.isFinite) && shows("forces");
    arrow.group.visible = arrow.centre.visible = loaded;
    if (!loaded) return;
    arrow.centre.position.set(...at, 0.001);
    arrow.group.position.set(...at, 0);
    arrow.group.quaternion.setFromUnitVectors(UP, push.normalize());
    arrow.shaft.scale.z = length - HEAD;
    arrow.tip.position.z = length - HEAD;
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
    moveGrid(...[0, 1].map((axis) => between(travel, 2, axis, start + low, start + high, share)));
  }

  // ---- words --------------------------------------------------------------------------------

  const nearest = () => FRAMES * state.stride + Math.round(state.percent);
  const onGround = (side) => Number.isFinite(stance[2 * nearest() + side]);

  function phaseName() {
    const [right, left] = SIDES.map((_, side) => onGround(side));
    if (right && left) return says.both;
    return right ? says.right : left ? says.left : says.none;
  }

  function words() {
    const left = cycle[2 * nearest() + 1];
    const values = {
      right: state.percent.toFixed(0),
      left: left.toFixed(0),
      seconds: figure((state.percent / LAST) * scene.seconds[state.stride]),
      stride: state.stride + 1,
      phase: phaseName(),
    };
    const text = Number.isFinite(left) ? says.with_left : says.right_alone;
    return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
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
    const frame = group.querySelector('g[id*="-patch_"] > path');
    if (!frame) return;
    const { x, y, width, height } = frame.getBBox();
    const attributes = { y1: y, y2: y + height, class: `replay-cursor ${SIDES[side]}`, "vector-effect": "non-scaling-stroke" };
    const line = element("line", { ...attributes, "aria-hidden": "true" }, group);
    // of a panel with both sides the right one's cycle is followed
    const first = !group.querySelector(".replay-hit");
    if (first) clickable(group, { x, y, width, height }, (point) => goTo(kind, side, (100 * within(point.x - x, 0, width)) / width));
    links.get(group.closest("figure")).push(() => {
      const percent = own(kind, side);
      line.style.visibility = Number.isFinite(percent) && shows("cursor") ? "" : "hidden";
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
      if (find(".replay-stride").value === "all") state.stride = (state.stride + 1) % scene.seconds.length;
    }
  }

  function play(on) {
    state.playing = on;
    before = null;
    find(".replay-play").textContent = on ? says.pause : says.play;
    if (!on) slider.setAttribute("aria-valuetext", words());
    if (pace.fine < 1) resize();
    announce();
    draw();
  }

  function seek(percent) {
    state.percent = within(Math.round(percent), 0, LAST);
    play(false);
  }

  function look(name) {
    state.view = name;
    for (const button of root.querySelectorAll("[data-view]")) button.setAttribute("aria-pressed", button.dataset.view === name);
    aim();
  }

  /* The whole walker is in the picture from every side, in wide pictures and in narrow ones. */
  const head = scene.shapes.find(({ segment, kind }) => segment === "torso" && kind === "sphere");
  const torso = scene.body.segments.indexOf("torso");
  const height = body.origin[3 * torso + 2] + head.position[2] + head.size[0];
  function aim() {
    const half = 0.5 * height + 0.12;
    const distance = (state.far * half) / Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180) / Math.min(1, camera.aspect);
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

  function zoom(factor) {
    const far = within(state.far * factor, 0.25, 3);
    camera.position.sub(orbit.target).multiplyScalar(far / state.far).add(orbit.target);
    state.far = far;
    orbit.update();
    draw();
  }

  // ---- controls -----------------------------------------------------------------------------

  function resize() {
    const { width, height } = find(".replay-stage").getBoundingClientRect();
    if (!width || !height) return;
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2) * (state.playing ? pace.fine : 1));
    renderer.setSize(width, height, false);
    draw();
  }

  const STEP = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 };
  const TURN = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowDown: [0, -0.1], ArrowUp: [0, 0.1] };
  const LOOK = { 0: "oblique", 1: "front", 2: "side", 3: "top" };

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
    find(".replay-play").addEventListener("click", () => play(!state.playing));
    slider.addEventListener("input", () => seek(Number(slider.value)));
    find(".replay-stride").addEventListener("change", (event) => {
      if (event.target.value !== "all") state.stride = Number(event.target.value);
      draw();
    });
    root.addEventListener("click", ({ target }) => {
      if (target.dataset.view) look(target.dataset.view);
      if (target.dataset.zoom) zoom(Number(target.dataset.zoom));
    });
    root.addEventListener("change", ({ target }) => {
      const name = target.dataset.shows;
      if (name && name !== "cursor") shown[name].forEach((object) => (object.visible = target.checked));
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
    find(".replay-stride").add(new Option(`${index + 1} (${figure(seconds)} s)`, index));
  });
  player.hidden = false;
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
