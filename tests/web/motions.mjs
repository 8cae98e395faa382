// A clip without a mesh, for the tests of the web package and its page: a person who walks, as BVH.

const joints = [  // name, parent, offset in centimetres; end: where it ends
  ['Hips', null, [0, 96, 0]], ['Spine', 'Hips', [0, 12, 0]], ['Chest', 'Spine', [0, 18, 0]], ['Neck', 'Chest', [0, 22, 0]], ['Head', 'Neck', [0, 8, 2], [0, 18, 0]],
  ...['Left', 'Right'].flatMap((side) => {
    const s = side === 'Left' ? 1 : -1;
    return [
      [`${side}Shoulder`, 'Chest', [4 * s, 18, 0]], [`${side}Arm`, `${side}Shoulder`, [14 * s, 0, 0]], [`${side}ForeArm`, `${side}Arm`, [28 * s, 0, 0]],
      [`${side}Hand`, `${side}ForeArm`, [25 * s, 0, 0], [10 * s, 0, 0]],
      [`${side}UpLeg`, 'Hips', [9 * s, -4, 0]], [`${side}Leg`, `${side}UpLeg`, [0, -42, 0]], [`${side}Foot`, `${side}Leg`, [0, -42, 0]],
      [`${side}ToeBase`, `${side}Foot`, [0, -7, 12], [0, 0, 6]],
    ];
  }),
];

// Degrees about x of a joint in a part of a turn.
function swing(name, turn) {
  const s = Math.sin(2 * Math.PI * turn), side = name.startsWith('Left') ? 1 : -1;
  if (name.endsWith('UpLeg')) return -25 * s * side - 5;
  if (name.endsWith('Leg')) return 20 + 15 * s * side;
  return name.endsWith('Arm') && !name.endsWith('ForeArm') ? 20 * s * side : 0;
}

/** The text of a BVH file with so many frames, 30 a second. */
export function bvhWalk(frames = 16) {
  const lines = ['HIERARCHY'];
  const add = ([name, parent, offset, end], depth) => {
    const pad = '\t'.repeat(depth);
    lines.push(`${pad}${parent === null ? 'ROOT' : 'JOINT'} ${name}`, `${pad}{`, `${pad}\tOFFSET ${offset.join(' ')}`);
    lines.push(`${pad}\tCHANNELS ${parent === null ? '6 Xposition Yposition Zposition' : '3'} Zrotation Xrotation Yrotation`);
    for (const child of joints) if (child[1] === name) add(child, depth + 1);
    if (end) lines.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET ${end.join(' ')}`, `${pad}\t}`);
    lines.push(`${pad}}`);
  };
  add(joints[0], 0);
  const order = lines.filter((line) => /ROOT|JOINT/.test(line)).map((line) => line.trim().split(' ')[1]);
  lines.push('MOTION', `Frames: ${frames}`, 'Frame Time: 0.0333333');
  for (let i = 0; i < frames; ++i) {
    const numbers = [0, 96, 4 * i];
    // Arms hang: down about z, the left one clockwise.
    for (const name of order) {
      const hang = /^(Left|Right)Arm$/.test(name) ? (name.startsWith('Left') ? -70 : 70) : 0;
      numbers.push(hang, swing(name, i / frames), 0);
    }
    lines.push(numbers.map((x) => x.toFixed(4)).join(' '));
  }
  return `${lines.join('\n')}\n`;
}
