/* The body that the replay draws: smooth shapes from the lengths of the segments.

   `walkerBody({ joints, spheres, mass })` returns parts, each with its segment, its paint and its geometry in
   the frame of the segment (x forward, y left, z up, m). Lengths are those of the model; girths are
   those of a typical adult, wider for a body that is heavier for its legs. They have no meaning in the
   simulation. `walkerBody.lit` makes their material;
   `walkerBody.drawnSlowly()` says whether there is no graphics card; `walkerBody.tilt` lets a slope rise. */
"use strict";
const walkerBody = (() => {
  const SIDES = 24; // corners of a cross-section
  const ROWS = 5; // rows between two given cross-sections
  const CAP = [0.35, 0.65, 0.87, 0.97, 1]; // of the depth of a rounded end
  const TYPICAL = 84; // kg for a metre of leg
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  /* Rows through given ones, by Catmull and Rom's cubic. */
  function smooth(rings) {
    const found = [];
    rings.slice(0, -1).forEach((ring, i) => {
      const [before, after] = [rings[Math.max(i - 1, 0)], rings[Math.min(i + 2, rings.length - 1)]];
      const next = rings[i + 1];
      for (let row = 0; row < ROWS; row++) {
        const t = row / ROWS;
        found.push(
          ring.map((value, k) => {
            const [a, b] = [0.5 * (next[k] - before[k]), 0.5 * (after[k] - value)];
            const left = value - next[k];
            return value + t * (a + t * (-3 * left - 2 * a - b + t * (2 * left + a + b)));
          }),
        );
      }
    });
    return [...found, rings[rings.length - 1]];
  }

  /* A skin over cross-sections [along, across1, across2, half1, half2]. Along is z, across x and y; of a
     foot along is x, across y and z. `ends` are the depths of the rounded ends; `power` above 2 makes the
     sections squarer; nothing is below `floor`. */
  function loft(rings, { ends = [0.02, 0.02], power = 2, foot = false, floor = -Infinity } = {}) {
    const rows = smooth(rings);
    const closed = ([along, c1, c2, r1, r2], direction, depth) =>
      CAP.map((share) => {
        const left = Math.sqrt(1.0004 - share * share);
        return [along + direction * depth * share, c1, c2, r1 * left, r2 * left];
      });
    const rise = Math.sign(rows[rows.length - 1][0] - rows[0][0]);
    const all = [...closed(rows[0], -rise, ends[0]).reverse(), ...rows, ...closed(rows[rows.length - 1], rise, ends[1])];
    const round = (value) => Math.sign(value) * Math.abs(value) ** (2 / power);
    const points = all.flatMap(([along, c1, c2, r1, r2]) =>
      Array.from({ length: SIDES }, (_, i) => {
        const angle = (2 * Math.PI * i) / SIDES;
        const [u, v] = [c1 + r1 * round(Math.cos(angle)), c2 + r2 * round(Math.sin(angle))];
        return foot ? [along, u, Math.max(v, floor)] : [u, v, along];
      }).flat(),
    );
    const faces = [];
    // seen from the side to which the rows go, the corners run against the clock
    for (let row = 0; row + 1 < all.length; row++) {
      for (let i = 0; i < SIDES; i++) {
        const [a, b] = [row * SIDES + i, row * SIDES + ((i + 1) % SIDES)];
        const [c, d] = [a + SIDES, b + SIDES];
        faces.push(...(rise > 0 ? [a, b, d, a, d, c] : [a, d, b, a, c, d]));
      }
    }
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
    made.setIndex(faces);
    made.computeVertexNormals();
    return made;
  }

  function ball(position, radii, ...part) {
    const made = new THREE.SphereGeometry(1, 24, 16, ...part).rotateX(0.5 * Math.PI).scale(...radii);
    made.deleteAttribute("uv");
    return made.translate(...position);
  }

  /* A rod with round ends. */
  function rod(from, to, radius) {
    const start = new THREE.Vector3(...from);
    const along = new THREE.Vector3(...to).sub(start);
    const length = along.length();
    const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), along.normalize());
    const made = loft([[0, 0, 0, radius, radius], [length, 0, 0, radius, radius]], { ends: [radius, radius] });
    return made.applyQuaternion(turn).translate(...from);
  }

  function limb(length, girth, profile, ends) {
    const rings = profile.map(([share, x, depth, width]) => [-share * length, girth * x, 0, girth * depth, girth * width]);
    return loft(rings, { ends: ends.map((end) => girth * end) });
  }

  // share of the length, place of the middle forward, half depth and half width, m of a typical adult
  const THIGH = [[0, 0, 0.081, 0.079], [0.18, 0.004, 0.083, 0.08], [0.45, 0.006, 0.073, 0.07], [0.75, 0.004, 0.058, 0.056], [0.93, 0.004, 0.052, 0.051], [1, 0.003, 0.05, 0.049]];
  const SHANK = [[0, 0.003, 0.049, 0.048], [0.1, 0, 0.051, 0.05], [0.3, -0.013, 0.056, 0.053], [0.55, -0.008, 0.046, 0.043], [0.8, -0.001, 0.034, 0.033], [0.95, 0.001, 0.035, 0.034], [1, 0.003, 0.036, 0.035]];
  const UPPER_ARM = [[0, 0, 0.048, 0.044], [0.25, 0, 0.046, 0.042], [0.6, 0.002, 0.039, 0.037], [0.9, 0, 0.034, 0.033], [1, 0, 0.034, 0.033]];
  const FOREARM = [[0, 0, 0.034, 0.033], [0.2, 0.003, 0.037, 0.034], [0.6, 0.002, 0.03, 0.026], [0.95, 0, 0.024, 0.018], [1.08, 0.002, 0.03, 0.016], [1.28, 0.002, 0.037, 0.014], [1.42, 0, 0.033, 0.012], [1.6, -0.004, 0.026, 0.009]];
  const TOES = [[0.028, 1, 0.0125], [0.011, 0.97, 0.0095], [-0.003, 0.88, 0.009], [-0.016, 0.77, 0.0085], [-0.028, 0.66, 0.008]]; // place inward, length, radius

  function foot(ball, spheres, size, inward) {
    const sole = Math.min(...spheres.map(({ position, radius }) => position[2] - radius));
    const heel = Math.min(...spheres.map(({ position, radius }) => position[0] - radius));
    const ring = (x, high, wide, low = 0) => [x, 0, sole + low + 0.5 * high, size * wide, 0.5 * high];
    const top = -sole;
    return loft(
      [ring(heel + 0.012, 0.6 * top, 0.026), ring(-0.3 * ball, 1.02 * top, 0.032), ring(0.12 * ball, 1.12 * top, 0.034), ring(0.5 * ball, 0.82 * top, 0.037), ring(0.85 * ball, 0.55 * top, 0.042), ring(ball, 0.46 * top, 0.043)].map(
        ([x, y, ...rest]) => [x, y + inward * 0.06 * Math.max(x, 0), ...rest],
      ),
      { ends: [0.014, 0.012], power: 2.6, foot: true, floor: sole },
    );
  }

  function toes(spheres, size, inward) {
    const sole = Math.min(...spheres.map(({ position, radius }) => position[2] - radius));
    const tip = Math.max(...spheres.map(({ position, radius }) => position[0] + radius));
    const pad = loft([[-0.008, inward * 0.006, sole + 0.014, size * 0.042, 0.014], [0.45 * tip, inward * 0.008, sole + 0.011, size * 0.036, 0.011]], {
      ends: [0.01, 0.012],
      power: 2.4,
      foot: true,
      floor: sole,
    });
    return [
      pad,
      ...TOES.map(([place, share, radius]) => {
        const [y, r] = [inward * (size * place + 0.006), size * radius];
        return rod([0.25 * tip, 0.85 * y, sole + 1.1 * r], [share * tip - r, y, sole + r], r);
      }),
    ];
  }

  function pelvis(hip, waist, girth) {
    const wide = 1.72 * hip;
    const rings = [[-0.08, -0.012, 0.07, 0.62 * wide], [-0.035, -0.024, 0.1, 0.98 * wide], [0.02, -0.03, 0.106, 1.03 * wide], [0.5 * waist[2], -0.034, 0.098, 0.93 * wide], [0.8 * waist[2], 0.8 * waist[0], 0.088, 0.82 * wide], [waist[2], waist[0] + 0.004, 0.08, 0.72 * wide]];
    return loft(rings.map(([z, x, depth, width]) => [z, x, 0, girth * depth, girth * width]), { ends: [0.03, 0.01], power: 2.3 });
  }

  function trunk(hip, shoulder, girth) {
    const [wide, high, waist] = [-shoulder[1], shoulder[2], 1.72 * hip];
    const rings = [[-0.055, 0.004, 0.096, 0.9 * waist], [0.1, 0.006, 0.09, 0.8 * waist], [0.4, 0.012, 0.096, 0.45 * waist + 0.45 * wide], [0.68, 0.014, 0.106, 0.98 * wide], [0.88, 0.006, 0.098, 0.99 * wide], [1.0, -0.002, 0.078, 0.86 * wide], [1.1, -0.008, 0.06, 0.5 * wide], [1.2, -0.004, 0.05, 0.34 * wide]];
    return loft(rings.map(([share, x, depth, width]) => [share < 0 ? share : share * high, x, 0, girth * depth, girth * width]), { ends: [0.006, 0.02], power: 2.25 });
  }

  /* A head whose face looks forward: brow, nose, chin, ears, eyes and hair. */
  function head(high) {
    const k = clamp(high / 0.3, 0.85, 1.15);
    const at = ([x, y, z]) => [0.014 + k * x, k * y, 1.68 * high + k * z];
    const made = (place, radii, ...part) => ball(at(place), radii.map((radius) => k * radius), ...part);
    const neck = loft([[1.05 * high, -0.006, 0, 0.052 * k, 0.055 * k], [1.3 * high, 0.004, 0, 0.045 * k, 0.046 * k], [1.5 * high, 0.01, 0, 0.044 * k, 0.044 * k]]);
    const hair = ball([0, 0, 0], [0.101, 0.081, 0.108].map((radius) => k * radius), 0, 2 * Math.PI, 0, 0.5 * Math.PI);
    return {
      face: [
        neck,
        made([0, 0, 0], [0.097, 0.076, 0.104]),
        made([0.022, 0, -0.052], [0.068, 0.056, 0.058]), // jaw
        made([0.066, 0, -0.096], [0.02, 0.022, 0.016]), // chin
        made([0.1, 0, -0.022], [0.017, 0.013, 0.02]), // nose
        made([0.09, 0, 0.0], [0.014, 0.009, 0.028]),
        made([0.073, 0, 0.032], [0.02, 0.05, 0.016]), // brow
        made([0.078, 0, -0.062], [0.016, 0.024, 0.008]), // lips
        ...[1, -1].map((side) => made([-0.006, 0.076 * side, -0.012], [0.019, 0.009, 0.03])),
      ],
      eyes: [1, -1].map((side) => made([0.0835, 0.031 * side, 0.007], [0.006, 0.011, 0.0065])),
      hair: [hair.rotateY(-0.42).translate(...at([-0.006, 0, 0.008]))],
    };
  }

  /* Light comes from above and from the right in front, and edges are lit from behind; it is painted
     by the material, since lamps of three.js would cost time at every pixel. A `ghost` is seen through where one
     looks straight at it, and its outline stays. */
  function lit({ ghost = 0, ...options } = {}) {
    const material = new THREE.MeshBasicMaterial(options);
    material.onBeforeCompile = (shader) => {
      const lines = "varying vec3 litNormal;\nvarying vec3 litView;\n";
      shader.vertexShader =
        lines +
        shader.vertexShader.replace(
          "#include <project_vertex>",
          `#include <project_vertex>
          litNormal = mat3(modelMatrix) * normal;
          litView = cameraPosition - (modelMatrix * vec4(transformed, 1.0)).xyz;`,
        );
      shader.fragmentShader =
        lines +
        shader.fragmentShader.replace(
          "#include <opaque_fragment>",
          `vec3 litTo = normalize(litNormal);
          float litRim = pow(1.0 - clamp(abs(dot(litTo, normalize(litView))), 0.0, 1.0), 3.0);
          float litKey = max(dot(litTo, normalize(vec3(0.5, -0.45, 0.75))), 0.0);
          outgoingLight *= 0.42 + 0.2 * (0.5 + 0.5 * litTo.z) + 0.5 * litKey;
          outgoingLight += 0.16 * litRim * (0.5 + 0.5 * litTo.z);
          ${ghost ? `diffuseColor.a *= ${ghost.toFixed(2)} + 0.55 * litRim;` : ""}
          #include <opaque_fragment>`,
        );
    };
    material.customProgramCacheKey = () => `lit ${ghost}`;
    return material;
  }

  const parts = ({ joints, spheres, mass }) => {
    const of = (segment) => spheres.filter((sphere) => sphere.segment === segment);
    const leg = -joints.shank_r[2] - joints.foot_r[2];
    const girth = clamp(Math.sqrt(mass / leg / TYPICAL), 0.8, 1.35) * clamp(leg / 0.8, 0.85, 1.1);
    const size = clamp(leg / 0.8, 0.85, 1.15);
    const found = [];
    const add = (segment, paint, ...geometries) => found.push({ segment, paint, geometry: THREE.mergeGeometries(geometries) });
    const [hip, high] = [-joints.thigh_r[1], joints.upper_arm_r[2]];
    add("pelvis", "shorts", pelvis(hip, joints.torso, girth));
    add("torso", "body", trunk(hip, joints.upper_arm_r, girth));
    const { face, eyes, hair } = head(high);
    add("torso", "face", ...face);
    add("torso", "hair", ...hair, ...eyes);
    for (const side of ["r", "l"]) {
      const inward = side === "r" ? 1 : -1;
      const upper = -joints[`forearm_${side}`][2];
      add(`thigh_${side}`, side, limb(-joints[`shank_${side}`][2], girth, THIGH, [0.06, 0.045]));
      add(`shank_${side}`, side, limb(-joints[`foot_${side}`][2], girth, SHANK, [0.045, 0.034]));
      add(`foot_${side}`, side, foot(joints[`toes_${side}`][0], of(`foot_${side}`), size, inward));
      add(`toes_${side}`, side, ...toes(of(`toes_${side}`), size, inward));
      add(`upper_arm_${side}`, side, limb(upper, girth, UPPER_ARM, [0.045, 0.033]));
      const thumb = rod([0.026, inward * 0.004, -1.12 * upper], [0.05, inward * 0.008, -1.33 * upper], 0.0095 * size);
      add(`forearm_${side}`, side, limb(upper, size, FOREARM, [0.033, 0.02]), thumb);
    }
    return found;
  };

  /* Whether pictures are drawn without a graphics card, where smooth edges cost more than all else. */
  function drawnSlowly() {
    const probe = document.createElement("canvas").getContext("webgl2");
    const told = probe?.getExtension("WEBGL_debug_renderer_info");
    const name = told ? probe.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
    probe?.getExtension("WEBGL_lose_context")?.loseContext();
    return /swiftshader|llvmpipe|software|basic render/i.test(name);
  }

  /* Turn a scene in the axes of the ground into the room's, where z is up: a slope rises. */
  function tilt(scene, { room }) {
    if (!room) return;
    scene.quaternion.set(...room);
    scene.updateMatrixWorld(true);
  }
  return Object.assign(parts, { lit, drawnSlowly, tilt });
})();
