// usage: node package.mjs PACKAGE PROGRAM FOLDER
// The package in node, held against the program's results on the same weights.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Checks, partOf, read } from './compare.mjs';
import { bvhWalk } from './motions.mjs';

const [folder, program, out] = process.argv.slice(2).map((name) => path.resolve(name));
const { Mesh, Motion, PoseTransfer, memory, transferMotion, version } = await import(pathToFileURL(path.join(folder, 'index.js')));
const run = (...words) => execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], cwd: out });
rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
process.chdir(out);

const checks = new Checks();
const weights = path.join(folder, 'weights/human.safetensors');
const bytes = readFileSync(weights);
console.log(`npt ${await version()} in node ${process.version}`);

// ---- meshes ----

run('generate', '--shape-seed', '1', '--pose-seed', '1', '--out', 'a.ply');
run('generate', '--shape-seed', '2', '--pose-seed', '2', '--out', 'b.ply');
run('generate', '--shape-seed', '12', '--pose', 'natural', '--pose-seed', '22', '--out', 'c.obj');
run('generate', '--shape-seed', '32', '--pose', 'natural', '--pose-seed', '42', '--out', 'd.glb');
const [a, b, c, d] = await Promise.all(['a.ply', 'b.ply', 'c.obj', 'd.glb'].map((file) => read(Mesh, file)));
checks.expect(a.vertexCount === 6890 && a.faceCount === 13776 && a.name === 'a.ply', `a.ply: ${a.vertexCount} vertices, ${a.faceCount} faces`);
const made = await Mesh.mannequin({ shapeSeed: 1, pose: 'random', poseSeed: 1 });
checks.near(a.positions, made.positions, 'the mannequin', 1e-6);
for (const format of ['obj', 'ply', 'glb']) {
  const again = await Mesh.read(a.write(format), `again.${format}`);
  checks.near(a.positions, again.positions, `written as ${format} and read`, 1e-7);
  checks.expect(again.triangleCount === a.triangleCount, `${format}: ${again.triangleCount} triangles`);
}
const off = await Mesh.read(new TextEncoder().encode('OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n'), 'four.off');
checks.expect(off.vertexCount === 4 && off.triangles.length === 12, 'four.off');

// ---- transfers ----

const seconds = (f) => {
  const start = performance.now();
  const value = f();
  return [value, (performance.now() - start) / 1000];
};
const network = await PoseTransfer.open(bytes, { method: 'network', name: 'human.safetensors' });
run('transfer', '--weights', weights, '--method', 'network', '--identity', 'a.ply', '--pose', 'b.ply', '--out', 'network.ply');
checks.near((await read(Mesh, 'network.ply')).positions, network.apply(a, b).positions, 'by the network');
// The time of the processor, since this machine may be busy.
const times = Array.from({ length: 5 }, () => {
  const before = process.cpuUsage();
  network.apply(a, b);
  return process.cpuUsage(before).user / 1e6;
});
console.log(`a transfer of 6890 vertices by the network, bottleneck 256, one thread: ${Math.min(...times).toFixed(2)} s of the processor`);
// Arrays instead of meshes, and what was prepared.
const arrays = (mesh) => ({ positions: mesh.positions, triangles: mesh.triangles, name: mesh.name });
checks.near(network.apply(a, b).positions, network.apply(arrays(a), arrays(b)).positions, 'arrays', 0);
const character = network.character(arrays(a)), pose = network.pose(b, a.vertexCount);
checks.near(network.apply(a, b).positions, network.apply(character, pose).positions, 'prepared', 0);
const refined = await PoseTransfer.open(bytes, { method: 'network', pairings: 2, mirror: true, refine: true, seed: 3 });
run('transfer', '--weights', weights, '--method', 'network', '--pairings', '2', '--mirror', '--refine', '--seed', '3', '--identity', 'a.ply', '--pose', 'b.ply',
    '--out', 'refined.ply');
checks.near((await read(Mesh, 'refined.ply')).positions, refined.apply(a, b).positions, 'averaged, mirrored, refined');

const people = await PoseTransfer.open(bytes, { name: 'human.safetensors' });
checks.expect(people.hasBody && /people by body estimation/.test(people.description), people.description);
for (const [name, one, two] of [['paper', a, b], ['natural', c, d]]) {
  run('transfer', '--weights', weights, '--identity', one.name, '--pose', two.name, '--out', `${name}.ply`);
  const [result, time] = seconds(() => people.apply(one, two));
  checks.expect(result.method === 'body' && result.confidence > 0.9, JSON.stringify({ ...result, positions: null }));
  checks.near((await read(Mesh, `${name}.ply`)).positions, result.positions, `by body estimation, ${name} poses, ${time.toFixed(1)} s`, 6e-5);  // 0.1 mm at 1.75 m
}
checks.expect(people.apply(c, d).kind === 'person' && people.highConfidence === 0.85, `${people.apply(c, d).kind}, ${people.highConfidence}`);
const pair = { positions: Float32Array.from([...c.positions, ...d.positions.map((x, i) => (i % 3 ? x : x + 3))]),
               triangles: Uint32Array.from([...c.triangles, ...d.triangles.map((v) => v + c.vertexCount)]), name: 'pair' };
const second = (await PoseTransfer.open(bytes, { name: 'human.safetensors', figure: 2 })).apply(pair, c).positions;
checks.near(second.slice(0, c.positions.length), c.positions, 'of two figures the first one stays', 0);
checks.expect(second.slice(c.positions.length).some((x, i) => x !== pair.positions[c.positions.length + i]), 'of two figures the second one is posed');

// ---- four-legged animals ----

const animals = path.join(folder, 'weights/quadruped.safetensors');
run('generate', '--body', animals, '--shape', 'zero', '--pose', 'rest', '--out', 'animal.obj');
run('generate', '--body', animals, '--shape-seed', '3', '--pose', 'natural', '--pose-seed', '2', '--out', 'animal_pose.obj');
const [beast, running] = await Promise.all(['animal.obj', 'animal_pose.obj'].map((file) => read(Mesh, file)));
const both = await PoseTransfer.open(bytes, { name: 'human.safetensors', further: { 'quadruped.safetensors': readFileSync(animals) } });
run('transfer', '--weights', animals, '--identity', 'animal.obj', '--pose', 'animal_pose.obj', '--out', 'animal_result.obj');
const ran = both.apply(beast, running);
checks.expect(ran.method === 'body' && ran.kind === 'four-legged animal' && ran.confidence > 0.85, JSON.stringify({ ...ran, positions: null }));
checks.near((await read(Mesh, 'animal_result.obj')).positions, ran.positions, 'a four-legged animal');
const beastly = both.character(beast);
checks.expect(beastly.recognised && beastly.kind === 'four-legged animal' && beastly.domain === 'quadruped', `${beastly.kind}, ${beastly.domain}`);
checks.near(people.apply(c, d).positions, both.apply(c, d).positions, 'people beside animals', 0);
await checks.fails(() => both.apply(c, running), 'input', /animal_pose\.obj: found a pose of the domain 'quadruped', expected one of 'human'/, 'an animal onto a person');
await checks.fails(() => people.apply(beast, running), 'input', /not recognised as a person/, 'animals by people\'s weights alone');
const unsure = people.character(beast);
checks.expect(unsure.kind === '' && unsure.confidence < people.highConfidence, `${unsure.kind}, ${unsure.confidence}`);
for (const handle of [beastly, unsure, both, beast, running]) handle.close();
for (const [shape, natural] of [[1, 5], [10, 20], [11, 21], [13, 23]]) {
  const other = { shape: String(shape === 1 ? 3 : shape + 20), pose: String(natural === 5 ? 9 : natural + 20) };
  run('generate', '--shape-seed', String(shape), '--pose', 'natural', '--pose-seed', String(natural), '--out', 'e.obj');
  run('generate', '--shape-seed', other.shape, '--pose', 'natural', '--pose-seed', other.pose, '--out', 'f.glb');
  run('transfer', '--weights', weights, '--identity', 'e.obj', '--pose', 'f.glb', '--out', 'pair.ply');
  checks.near((await read(Mesh, 'pair.ply')).positions, people.apply(await read(Mesh, 'e.obj'), await read(Mesh, 'f.glb')).positions,
              `by body estimation, shape ${shape} in natural pose ${other.pose}`, 6e-5);
}
// As a GLB, with the program's units.
run('transfer', '--weights', weights, '--identity', 'c.obj', '--pose', 'd.glb', '--out', 'natural.glb');
checks.near((await read(Mesh, 'natural.glb')).positions,
            (await Mesh.read(c.write('glb', { positions: people.apply(c, d).positions, transfer: people }), 'own.glb')).positions, 'the GLB', 6e-5);

// ---- characters, trackers, animations ----

const hero = people.character(c);
checks.expect(hero.recognised && hero.confidence > 0.9 && hero.domain === 'human' && hero.warnings.length === 0, JSON.stringify(hero.warnings));
const again = people.loadCharacter(hero.save(), { name: 'hero.safetensors' });
const guard = people.pose(d, c.vertexCount);
checks.near(people.apply(hero, guard).positions, people.apply(again, guard).positions, 'a character that was saved', 1e-7);
const tracker = people.tracker();
checks.near(people.apply(hero, guard).positions, people.apply(hero, tracker.next(d, c.vertexCount)).positions, 'the first frame of a sequence', 0);
const frames = [0, 1, 2].map((k) => ({ positions: d.positions.map((x, i) => (i % 3 === 2 ? x + 0.1 * k : x)), triangles: d.triangles, name: 'd.glb' }));
const animation = people.animate(hero, frames);
checks.expect(animation.length === 3 && animation.report.method === 'body', JSON.stringify(animation.reports));
const gone = (at) => animation.frame(at).reduce((sum, x, i) => (i % 3 === 2 ? sum + x : sum), 0) / hero.mesh.vertexCount;
checks.expect(Math.abs(gone(2) - gone(0) - 0.2) < 0.1, `the root went ${gone(2) - gone(0)}, expected about 0.2`);
const glb = await Mesh.read(animation.write({ clip: 'walk', fps: 24 }), 'animation.glb');
checks.expect(glb.clips.length === 1 && glb.clips[0].name === 'walk' && glb.frameTimes(0, 24).length === 3, JSON.stringify(glb.clips));
glb.moveTo(0, 1 / 24);
checks.near(animation.frame(1), glb.positions, 'a frame of the clip', 2e-3);  // a file keeps the four largest weights of a vertex
glb.moveTo(null);
checks.near(c.positions, glb.positions, 'the clip at rest', 1e-4);
// Weights that name the file with their body estimation.
const pooled = readFileSync(path.join(folder, 'weights/human-pooled.safetensors'));
const beside = await PoseTransfer.open(pooled, { name: 'human-pooled.safetensors', others: { 'human.safetensors': bytes } });
checks.near(people.apply(hero, guard).positions, beside.apply(c, d).positions, 'weights beside those of body estimation', 1e-7);
await checks.fails(() => PoseTransfer.open(pooled, { name: 'human-pooled.safetensors' }), 'input', /human\.safetensors/, 'weights without what they name');

// ---- skeletons ----

run('rig', '--weights', weights, '--mesh', 'c.obj', '--out', 'hero.glb');
writeFileSync('walk.bvh', bvhWalk());
run('transfer', '--identity', 'hero.glb', '--pose', 'walk.bvh', '--out', 'hero_walk.glb');
const rigged = await read(Motion, 'hero.glb'), walk = await read(Motion, 'walk.bvh');
checks.expect(walk.clip === 'walk' && walk.fps === 30 && Math.abs(walk.length - 0.5) < 1e-6 && walk.vertexCount === 0, `walk.bvh: ${walk.clip}, ${walk.fps}, ${walk.length}`);
checks.expect(walk.joints.some(({ name, role }) => name === 'LeftUpLeg' && role === 'leftUpperLeg'), JSON.stringify(walk.joints));
checks.expect(rigged.joints.length === 40 && rigged.vertexCount > 0 && rigged.clips.length === 0, `hero.glb: ${rigged.joints.length} joints`);
const [walked, walkTime] = seconds(() => transferMotion(rigged, walk));
console.log(`a clip of ${walked.frameTimes().length} frames onto 40 joints: ${(1000 * walkTime).toFixed(0)} ms`);
checks.expect(walked.confidence > 0.6 && walked.ownJoints && walked.clip === 'walk', `${walked.confidence}, ${walked.clip}`);
const theirs = await read(Motion, 'hero_walk.glb');
for (const time of [0, 0.21, 0.5]) {
  checks.near(theirs.jointsAt(time), walked.jointsAt(time), `joints at ${time} s`, 1e-6);
  checks.near(theirs.positionsAt(time), walked.positionsAt(time), `vertices at ${time} s`, 1e-6);
}
const patched = await Motion.read(walked.write('glb'), 'patched.glb');
checks.near(walked.positionsAt(0.3), patched.positionsAt(0.3), 'the clip in the character\'s file', 1e-6);
checks.expect(patched.joints.every(({ name }, j) => name === rigged.joints[j].name), 'joints got other names');
const asBvh = await Motion.read(walked.write('bvh'), 'again.bvh');
checks.expect(Math.abs(asBvh.length - walked.length) < 1e-3 && asBvh.joints.filter(({ end }) => !end).length >= 40, `again.bvh: ${asBvh.length} s, ${asBvh.joints.length} joints`);
const still = transferMotion(rigged, walk, { inPlace: true, footLock: false });
const hips = rigged.joints.findIndex(({ role }) => role === 'hips');
const way = (motion) => Math.hypot(...[0, 2].map((k) => motion.jointsAt(0.5)[3 * hips + k] - motion.jointsAt(0)[3 * hips + k]));
checks.expect(way(still) < 0.02 && way(walked) > 0.3, `in place: ${way(still)} m, else ${way(walked)} m`);
const onBody = transferMotion(hero, walk);
checks.expect(!onBody.ownJoints && onBody.vertexCount === c.vertexCount, `${onBody.vertexCount} vertices`);
const bodyFile = await Motion.read(onBody.write('glb'), 'body.glb');
checks.expect(bodyFile.clip === 'walk' && bodyFile.joints.length === 40, `body.glb: ${bodyFile.clip}`);
checks.near(onBody.positionsAt(0.3), bodyFile.positionsAt(0.3), 'a clip on an estimated body', 2e-3);
await checks.fails(() => Motion.read(c.write('glb'), 'mesh.glb'), 'input', /mesh\.glb: found no skeleton/, 'a mesh without a skeleton');
await checks.fails(() => Motion.read(walked.write('glb'), 'one.glb', { clip: 7 }), 'input', /found 1 clips, expected more than 7/, 'a clip that is none');
await checks.fails(() => transferMotion(walk, rigged), 'input', /hero\.glb: found a skeleton without a clip/, 'no clip');
await checks.fails(() => transferMotion(rigged, walk, { clearance: 2 }), 'argument', /clearance/, 'a clearance beyond 1');
await checks.fails(() => transferMotion(walk, walk).write('glb'), 'argument', /is written as bvh/, 'BVH as GLB');
for (const handle of [rigged, walk, walked, theirs, patched, asBvh, still, onBody, bodyFile, animation, tracker, guard, again, hero, beside]) handle.close();

// ---- bad input ----

await checks.fails(() => Mesh.read(new Uint8Array(0), 'empty.obj'), 'input', /empty\.obj/, 'an empty file');
await checks.fails(() => Mesh.read(new Uint8Array([137, 80, 78, 71, 13, 10]), 'picture.ply'), 'input', /picture\.ply/, 'no mesh');
await checks.fails(() => Mesh.read(new Uint8Array(9), 'mesh.xyz'), 'input', /\.xyz/, 'another format');
await checks.fails(() => PoseTransfer.open(new Uint8Array(100), { name: 'bad.safetensors' }), 'input', /bad\.safetensors/, 'no weights');
await checks.fails(() => PoseTransfer.open(partOf(bytes, 'correspondence/'), { name: 'part.safetensors' }), 'input', /part\.safetensors/, 'weights of another network');
await checks.fails(() => PoseTransfer.open(bytes, { method: 'magic' }), 'argument', /magic/, 'an option that is none');
await checks.fails(() => network.apply({ positions: [0, 0, 0, 1, NaN, 1] }, b), 'input', /finite|nan/i, 'no finite numbers');
await checks.fails(() => network.apply({ positions: new Float32Array(0) }, b), 'input', /./, 'no vertices');
await checks.fails(() => people.apply(off, b), 'input', /four\.off: found a mesh that is not recognised as a person \(confidence/, 'a tetrahedron as a person');
const four = people.character(off), [warning] = four.warnings;
checks.expect(!four.recognised && four.confidence < 0.6 && warning.code === 'not_recognised' && warning.mesh === 'identity' &&
              /four\.off is not recognised/.test(warning.text), `a tetrahedron as a character: ${JSON.stringify(four.warnings)}`);
four.close();
const far = { positions: off.positions.map((x) => 1000000 * x), triangles: off.triangles, name: 'far.off' };
await checks.fails(() => people.apply(far, b), 'input', /far\.off.*person/, 'a tetrahedron of no person\'s size');
await checks.fails(() => { made.close(); return made.positions; }, 'argument', /close/, 'a closed mesh');
// Memory that is short comes back as an error, and the module works on.
const huge = new Float32Array(3 * 4e6).map((_, i) => Math.sin(i));
await checks.fails(() => network.apply({ positions: huge }, b), 'memory', /memory/, 'too large a mesh');
checks.near(network.apply(character, pose).positions, network.apply(a, b).positions, 'after that', 0);

// Closing gives the memory back: what was used once is used again.
const before = memory();
for (let i = 0; i < 20; ++i) {
  const mesh = await read(Mesh, 'b.ply');
  people.character(mesh).close();
  mesh.close();
}
checks.expect(memory() <= before, `memory grew from ${before} to ${memory()}`);
writeFileSync('done', '');
checks.end();
