// usage: node worker.mjs WEB PROGRAM FOLDER
// The page's worker in node: which weights it fetches, and when. WEB: what build.sh left.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { Checks, read } from './compare.mjs';

const [web, program, out] = process.argv.slice(2).map((name) => path.resolve(name));
rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
process.chdir(out);
const run = (...words) => execFileSync(program, words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], cwd: out });
const checks = new Checks();

// What a worker has that node lacks.
const fetched = [], waiting = new Map();
globalThis.onmessage = null;
globalThis.postMessage = ({ id, value, error }) => {
  if (id === undefined) return;  // progress
  waiting.get(id)(error ? { error } : { value });
  waiting.delete(id);
};
globalThis.fetch = async (url) => {
  fetched.push(path.basename(url.pathname));
  const bytes = readFileSync(fileURLToPath(url));
  return { ok: true, headers: { get: () => null }, arrayBuffer: async () => bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length) };
};
await import(pathToFileURL(path.join(web, 'page/worker.js')));
const { Mesh } = await import(pathToFileURL(path.join(web, 'package/index.js')));

let ids = 0;
const ask = (name, request) => new Promise((done) => {
  waiting.set(++ids, done);
  globalThis.onmessage({ data: { id: ids, name, ...request } });
});
const open = async (key, file) => (await ask('open', { key, source: { name: file, bytes: readFileSync(file), others: {} } })).value;
const transfer = (identity, pose, poses) => ask('transfer', {
  identity, pose, poses, clip: null, weights: 'auto', file: null, followRoot: true, fps: 24, motion: {},
  options: { method: 'automatic', pairings: 1, mirror: false, refine: false, unit: 0 },
});
const posed = (mesh) => ({ positions: mesh.positions, triangles: mesh.triangles, name: mesh.name });

const animals = path.join(web, 'page/weights/quadruped.safetensors');
run('generate', '--shape-seed', '12', '--pose', 'natural', '--pose-seed', '22', '--out', 'c.obj');
run('generate', '--shape-seed', '32', '--pose', 'natural', '--pose-seed', '42', '--out', 'd.obj');
run('generate', '--body', animals, '--shape', 'zero', '--pose', 'rest', '--out', 'animal.obj');
run('generate', '--body', animals, '--shape-seed', '3', '--pose', 'natural', '--pose-seed', '2', '--out', 'animal_pose.obj');
const [c, d, beast, running] = [await open(1, 'c.obj'), await open(2, 'd.obj'), await open(3, 'animal.obj'), await open(4, 'animal_pose.obj')];
checks.expect(c.vertexCount === 6890 && beast.vertexCount === running.vertexCount, `${c.vertexCount}, ${beast.vertexCount}`);

const person = await transfer(1, 2, [posed(d)]);
checks.expect(person.value?.report.kind === 'person', JSON.stringify(person.error ?? person.value.report));
checks.expect(fetched.join() === 'human.safetensors', `people: fetched ${fetched}`);

// An animal's pose for a person is refused as the program does it, and for that the animals' weights are fetched.
const refused = await transfer(1, 4, [posed(running)]);
checks.expect(refused.error?.code === 'domains_differ', JSON.stringify(refused.error ?? refused.value.report));
checks.expect(fetched.join() === 'human.safetensors,quadruped.safetensors', `an animal: fetched ${fetched}`);

const animal = await transfer(3, 4, [posed(running)]);
checks.expect(animal.value?.report.kind === 'four-legged animal', JSON.stringify(animal.error ?? animal.value.report));
run('transfer', '--weights', animals, '--identity', 'animal.obj', '--pose', 'animal_pose.obj', '--out', 'expected.obj');
checks.near((await read(Mesh, 'expected.obj')).positions, animal.value.frames[0], 'an animal in the page');
const gait = await transfer(3, 4, [posed(running), posed(running)]);
checks.expect(gait.value?.report.kind === 'four-legged animal' && gait.value.frames.length === 2, JSON.stringify(gait.error ?? gait.value.report));
const again = await transfer(1, 2, [posed(d)]);
checks.near(person.value.frames[0], again.value.frames[0], 'a person after animals', 0);
checks.expect(fetched.length === 2, `in all: fetched ${fetched}`);
writeFileSync('done', '');
checks.end();
