// What can be seen at once: the built-in mannequin in a few shapes and poses, made where it is shown.

// A walk of a second, from sines: axis angles of 24 joints and how far the body has gone (as examples/animate.sh makes it).
function walk(count) {
  // An arm down about z, then swung about x: one axis angle.
  const hang = (down, swing) => {
    const w = Math.cos(swing / 2) * Math.cos(down / 2);
    const v = [Math.sin(swing / 2) * Math.cos(down / 2), -Math.sin(swing / 2) * Math.sin(down / 2), Math.cos(swing / 2) * Math.sin(down / 2)];
    const sine = Math.hypot(...v), angle = 2 * Math.atan2(sine, w);
    return v.map((x) => x * angle / sine);
  };
  return Array.from({ length: count }, (_, i) => {
    const turn = 2 * Math.PI * i / count, s = Math.sin(turn), c = Math.cos(turn);
    const angles = new Float32Array(72);
    const set = (joint, x, y = 0, z = 0) => angles.set([x, y, z], 3 * joint);
    set(0, 0, 0.08 * s);
    set(1, -0.45 * s - 0.15), set(2, 0.45 * s - 0.15);                                 // hips
    set(4, 0.35 + 0.45 * Math.max(c, 0)), set(5, 0.35 - 0.45 * Math.min(c, 0));        // knees bend while their leg comes forward
    set(7, -0.1), set(8, -0.1);
    set(3, 0, -0.07 * s), set(6, 0, -0.07 * s);                                        // the chest turns back
    set(12, 0.1);
    set(16, ...hang(-1.25, 0.45 * s)), set(17, ...hang(1.25, -0.45 * s));
    set(18, 0, -0.45), set(19, 0, 0.45);                                               // elbows
    return { angles, shift: [0, 0.015 * Math.cos(2 * turn), 1.3 * i / count] };
  });
}

const person = (name, shapeSeed, proportions = false) => ({ name, role: 'identity', mesh: { shapeSeed, proportions, pose: 'rest' } });
const pose = (name, poseSeed) => ({ name, role: 'pose', mesh: { shapeSeed: 77, pose: 'natural', poseSeed } });

export const samples = {
  character: person('Large head, short legs', 41, true),
  slight: person('Slight', 1),
  tall: person('Tall', 5),
  sturdy: person('Sturdy', 8),
  broad: person('Long neck, broad hips', 43, true),
  leap: pose('Leap', 9),
  run: pose('Run', 16),
  kick: pose('Kick', 14),
  crouch: pose('Crouch', 19),
  arms: pose('Arms up', 11),
  guard: pose('On guard', 17),
  walk: { name: 'Walk, 24 frames', role: 'pose', mesh: { shapeSeed: 2, frames: walk(24) } },
};
