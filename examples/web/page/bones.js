// Skeletons for the page: when a clip goes from joints to joints, and bones as a mesh that can be shown.

export const isBvh = (name = '') => /\.bvh$/i.test(name);

// Clips that come with a mesh have another way, which knows nothing of joints: theirs must be certain.
export const jointsSettle = ({ confidence }) => confidence >= 0.6;

const add = (a, b, share = 1) => a.map((x, k) => x + share * b[k]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function unit(a) {
  const length = Math.hypot(...a);
  return length > 0 ? a.map((x) => x / length) : a;
}

// { positions, triangles } of joints, { parent }, at places [3 J]: an octahedron from each joint's parent to it. Bones of a joint
// without a parent lead from where the figure stands, and are left out.
export function bonesMesh(joints, places) {
  const positions = [], triangles = [];
  const at = (j) => [...places.subarray(3 * j, 3 * j + 3)];
  joints.forEach(({ parent }, j) => {
    if (parent < 0 || joints[parent].parent < 0) return;
    const from = at(parent), to = at(j), bone = add(to, from, -1);
    const side = unit(cross(bone, Math.abs(bone[1]) > Math.abs(bone[0]) ? [1, 0, 0] : [0, 1, 0])), other = unit(cross(bone, side));
    const width = 0.12 * Math.hypot(...bone), middle = add(from, bone, 0.2), first = positions.length / 3;
    positions.push(...from);
    for (const [out, sign] of [[side, 1], [other, 1], [side, -1], [other, -1]]) positions.push(...add(middle, out, sign * width));
    positions.push(...to);
    for (let i = 0; i < 4; ++i) {
      const a = first + 1 + i, b = first + 1 + (i + 1) % 4;
      triangles.push(first, b, a, first + 5, a, b);
    }
  });
  return { positions: Float32Array.from(positions), triangles: Uint32Array.from(triangles) };
}
