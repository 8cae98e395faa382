// What computes: the package, in a thread of its own. Requests come as { id, name, ... }, answers go as { id, value } or { id, error },
// progress as { progress, share }. One transfer runs at a time; another request for one ends it at its next step.
import { Mesh, Motion, NptError, PoseTransfer, framesToTry, load, transferMotion } from './npt/index.js';
import { bonesMesh, isBvh, jointsSettle } from './bones.js';
import { samples } from './samples.js';

load().catch(() => {});  // the first request says what went wrong

// ---- what is kept ----

const meshes = new Map();  // by key
const rigs = new Map();    // of those files that have a skeleton, by key: { rig, alone }, at rest; alone: without a mesh
let opened = null;         // { key, transfer, animals }: of one weights file and its options; animals: theirs, too
let prepared = null;       // { mesh, transfer, character }: of the identity that was transferred to last
let made = null;           // { transfer, mesh, frames, animation, motion }: what can be saved
let run = 0;               // of the transfer that is wanted

const progress = (text, share = null) => postMessage({ progress: text, share });
// Lets messages in: another request may have come.
const breathe = () => new Promise((done) => { setTimeout(done, 0); });

class Stopped extends Error {}

async function fetchBytes(url, text) {
  const response = await fetch(url);
  if (!response.ok) throw new NptError(`${url}: ${response.status} ${response.statusText}`, 'input');
  const length = Number(response.headers.get('content-length'));
  if (!response.body || !length) return new Uint8Array(await response.arrayBuffer());
  const parts = [];
  let got = 0;
  for (const reader = response.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    got += value.length;
    progress(text, Math.min(1, got / length));
  }
  const bytes = new Uint8Array(got);
  let at = 0;
  for (const part of parts) bytes.set(part, at), at += part.length;
  return bytes;
}

const fetched = new Map();
function shipped(name) {
  if (!fetched.has(name)) {
    const loading = fetchBytes(new URL(`weights/${name}.safetensors`, import.meta.url), 'Loading weights');
    loading.catch(() => fetched.delete(name));
    fetched.set(name, loading);
  }
  return fetched.get(name);
}

// ---- meshes ----

async function makeMesh(source) {
  if (source.groundTruth) {  // the shape of one sample in the pose of another
    const [shape, pose] = source.groundTruth.map((key) => samples[key].mesh);
    const angles = pose.frames ? pose.frames[source.frame].angles : null;
    return Mesh.mannequin({ ...shape, pose: pose.pose, poseSeed: pose.poseSeed, angles, name: 'ground truth' });
  }
  if (source.sample) {
    const { frames, ...options } = samples[source.sample].mesh;
    const angles = frames ? frames[source.frame ?? 0].angles : null;
    return Mesh.mannequin({ ...options, angles, name: samples[source.sample].name });
  }
  return Mesh.read(source.bytes, source.name, source.others);
}

const shownOf = (mesh) => ({
  name: mesh.name, vertexCount: mesh.vertexCount, faceCount: mesh.faceCount, clips: mesh.clips, positions: mesh.positions, triangles: mesh.triangles,
});

function moved(positions, shift) {
  if (!shift) return positions;
  for (let i = 0; i < positions.length; ++i) positions[i] += shift[i % 3];
  return positions;
}

// The skeleton of a file, without a clip; null: it has none that could be used, `why` says the reason.
async function rigOf(source, clip = null) {
  if (!source.bytes || !/\.(glb|gltf|vrm|bvh)$/i.test(source.name)) return { rig: null };
  try {
    return { rig: await Motion.read(source.bytes, source.name, { clip, others: source.others }) };
  } catch (error) {
    if (error.kind !== 'input') throw error;
    return { rig: null, why: error };
  }
}

async function open({ key, source }) {
  const { rig, why } = await rigOf(source);
  let mesh = null;
  try {
    mesh = isBvh(source.name) ? null : await makeMesh(source);
  } catch (error) {
    if (!rig || error.kind !== 'input') throw error;  // a skeleton alone
  }
  if (!mesh && !rig) throw why;
  drop({ key });
  if (rig) rigs.set(key, { rig, alone: !mesh });
  if (!mesh) return shownBones(rig);
  meshes.set(key, mesh);
  return { ...shownOf(mesh), jointCount: rig ? countOf(rig) : 0 };
}

const countOf = ({ joints }) => joints.filter(({ end }) => !end).length;
const shownBones = (rig) => ({
  name: rig.name, vertexCount: 0, faceCount: 0, jointCount: countOf(rig), clips: rig.clips, ...bonesMesh(rig.joints, rig.jointsAt(null)),
});

function drop({ key }) {
  rigs.get(key)?.rig.close();
  rigs.delete(key);
  const mesh = meshes.get(key);
  if (!mesh) return;
  if (prepared && prepared.mesh === mesh) prepared.character.close(), prepared = null;
  meshes.delete(key);
  if (!made || made.mesh !== mesh) mesh.close();
}

// What a motion shows at some times: its mesh, or its bones.
async function shownFrames(motion, times, text) {
  const shown = [];
  for (const [i, time] of times.entries()) {
    shown.push(motion.vertexCount > 0 ? motion.positionsAt(time) : bonesMesh(motion.joints, motion.jointsAt(time)).positions);
    if (i % 16 === 15) {
      progress(text, i / times.length);
      await breathe();
    }
  }
  return shown;
}

const mostFrames = 2000;
function timesOf(what, clip, fps) {
  const times = what.frameTimes(...(clip === undefined ? [fps] : [clip, fps]));
  if (times.length > mostFrames) throw new NptError(`${what.name}: ${times.length} frames at ${fps} a second, expected at most ${mostFrames}`, 'input');
  return times;
}

// A clip of a skeleton alone: the bones of each frame.
async function framesOfBones({ source, clip, fps }) {
  const motion = await Motion.read(source.bytes, source.name, { clip, others: source.others });
  try {
    const frames = await shownFrames(motion, timesOf(motion, undefined, fps), 'Reading the clip');
    return { frames, ...bonesMesh(motion.joints, motion.jointsAt(null)) };
  } finally {
    motion.close();
  }
}

// All frames of a pose for showing, and how each is brought about; with triangles where they are others than those at rest.
async function frames({ key, source, clip, fps }) {
  if (rigs.get(key)?.alone) return framesOfBones({ source, clip, fps });
  return { frames: await framesOfMesh({ key, source, clip, fps }) };
}

async function framesOfMesh({ key, source, clip, fps }) {
  const mesh = meshes.get(key);
  const steps = source.sample ? samples[source.sample].mesh.frames : null;
  if (steps) {
    const shown = [];
    for (let i = 0; i < steps.length; ++i) {
      progress('Making the sequence', i / steps.length);
      const step = await makeMesh({ ...source, frame: i });
      shown.push(moved(step.positions, steps[i].shift));
      step.close();
      await breathe();
    }
    return shown;
  }
  if (clip === null) return [mesh.positions];
  const times = timesOf(mesh, clip, fps);
  const shown = [];
  for (const [i, time] of times.entries()) {
    mesh.moveTo(clip, time);
    shown.push(mesh.positions);
    if (i % 16 === 15) {
      progress('Reading the clip', i / times.length);
      await breathe();
    }
  }
  return shown;
}

// ---- transfers ----

// The file beside weights that holds their body estimation, where they name one; null also for what is no weights at all.
function bodyNamed(bytes) {
  try {
    const length = Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(0, true));
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
    return header.__metadata__?.body ?? null;
  } catch {
    return null;
  }
}

// By default four-legged animals are recognised, too. Their weights are as large as people's: they are fetched when a mesh isn't surely a person.
const byDefault = ({ weights, file, options }) => weights === 'auto' && !file && options.method !== 'network';
class Unsure extends Error {}
function expectSure(request, use, confidence) {
  if (confidence !== null && confidence < use.highConfidence && byDefault(request) && !opened.animals) throw new Unsure();
}

async function transferOf({ weights, file, options }, animals) {
  const key = JSON.stringify([weights, file && file.name, file && file.key, options]);
  if (opened && opened.key === key && (opened.animals || !animals)) return opened.transfer;
  progress('Loading weights', 0);
  const bytes = file ? file.bytes : await shipped(weights === 'auto' ? 'human' : weights);
  const beside = options.method === 'network' ? null : bodyNamed(bytes);
  const others = beside === 'human.safetensors' ? { [beside]: await shipped('human') } : {};
  // A page without the file knows people alone.
  const theirs = animals ? await shipped('quadruped').catch(() => null) : null;
  const further = theirs ? { 'quadruped.safetensors': theirs } : {};
  progress('Opening weights');
  await breathe();
  const name = file ? file.name : `${weights === 'auto' ? 'human' : weights}.safetensors`;
  const transfer = await PoseTransfer.open(bytes, { ...options, others, further, name });
  if (prepared) prepared.character.close(), prepared = null;
  if (opened && !(made && made.transfer === opened.transfer)) opened.transfer.close();
  opened = { key, transfer, animals };
  return transfer;
}

// A result that can be saved, with all that this needs, until another one takes its place.
function keep(next) {
  const last = made;
  made = next;
  if (!last) return;
  last.animation?.close();
  last.motion?.close();
  if (last.mesh && last.mesh !== next.mesh && !isKept(last.mesh)) last.mesh.close();
  if (last.transfer && last.transfer !== next.transfer && last.transfer !== opened.transfer) last.transfer.close();
}
const isKept = (mesh) => [...meshes.values()].includes(mesh);

// The clip that is to be put on joints, and those: { source, target }; null where meshes are to be transferred. target null: no joints of its own.
async function jointsOf({ identity, pose, source, clip, options }) {
  const from = rigs.get(pose), to = rigs.get(identity);
  if (!from || (clip === null && !from.alone)) return null;
  const asked = options.method !== 'automatic' || options.refine;
  if (!from.alone && (!to || !jointsSettle(to.rig) || asked)) return null;
  if (clip === null) throw new NptError(`${from.rig.name}: a skeleton without a clip, expected curves that move its joints`, 'input');
  const { rig, why } = await rigOf(source, clip);
  if (!rig && from.alone) throw why;
  if (!rig || (!from.alone && !jointsSettle(rig))) {
    rig?.close();
    return null;
  }
  return { source: rig, target: to ? to.rig : null };
}

// A clip from joints to joints.
async function transferJoints({ source, target }, request, wanted, animals) {
  const start = performance.now(), mesh = meshes.get(request.identity) ?? null;
  try {
    let character = target, use = null;
    if (!target) {
      use = await transferOf(request, animals);
      character = await characterOf(mesh, use, wanted);
      expectSure(request, use, character.confidence);
    }
    progress('Posing');
    await wanted();
    const motion = transferMotion(character, source, request.motion);
    try {
      const frames = await shownFrames(motion, timesOf(motion, undefined, request.fps), 'Posing');
      const bones = mesh ? {} : bonesMesh(motion.joints, motion.jointsAt(null));
      await wanted();
      keep({ transfer: use, mesh, frames, animation: null, motion });
      const { confidence, warnings } = motion;
      return { frames, triangles: bones.triangles, report: { method: 'joints', confidence, warnings, ownJoints: target !== null },
               seconds: (performance.now() - start) / 1000, unit: use ? use.unitOf(mesh) : 1, threads: 1 };
    } catch (error) {
      motion.close();
      throw error;
    }
  } finally {
    source.close();
  }
}

async function characterOf(identity, use, wanted) {
  if (prepared && prepared.mesh === identity && prepared.transfer === use) return prepared.character;
  progress(`Looking at ${identity.name}`);
  await wanted();
  const next = use.character(identity);
  if (prepared) prepared.character.close();
  prepared = { mesh: identity, transfer: use, character: next };
  return next;
}

async function transfer({ own, ...request }) {
  const wanted = async () => {
    await breathe();
    if (own !== run) throw new Stopped();
  };
  try {
    return await transferBy(request, wanted, false);
  } catch (error) {
    if (!(error instanceof Unsure)) throw error;
    return transferBy(request, wanted, true);
  }
}

// animals: whether their weights are asked, too
async function transferBy(request, wanted, animals) {
  const joints = await jointsOf(request);
  if (joints) return transferJoints(joints, request, wanted, animals);
  if (!meshes.get(request.identity)) throw new NptError(`${rigs.get(request.identity).rig.name}: a skeleton alone, expected a mesh, or a clip to put on it`, 'input');
  const start = performance.now();
  const use = await transferOf(request, animals);
  await wanted();
  const identity = meshes.get(request.identity);
  const character = await characterOf(identity, use, wanted);
  expectSure(request, use, character.confidence);
  const { poses, rest } = request;  // [{ positions, triangles, name }], and the same of the clip's rig at rest
  const answer = (frames, { method, kind, confidence, warnings }) =>
    ({ frames, report: { method, kind, confidence, warnings }, seconds: (performance.now() - start) / 1000, unit: use.unitOf(identity), threads: use.threads });
  if (poses.length === 1) {
    progress(`Looking at ${poses[0].name}`);
    await wanted();
    const pose = use.pose(poses[0], identity.vertexCount);
    try {
      expectSure(request, use, pose.confidence);
      progress('Posing');
      await wanted();
      const result = use.apply(character, pose);
      keep({ transfer: use, mesh: identity, frames: [result.positions], animation: null });
      return answer([result.positions], result);
    } finally {
      pose.close();
    }
  }
  const animation = use.animation(character);
  try {
    for (let i = 0; i < poses.length; ++i) {
      progress(`Frame ${i + 1} of ${poses.length}`, i / poses.length);
      await wanted();
      if (i > 0) animation.add(poses[i]);
      else startOf(animation, request, use, [...(rest ? [rest] : []), ...framesToTry(poses.length).map((k) => poses[k])]);
    }
    animation.finish({ followRoot: request.followRoot });
    const shown = poses.map((_, i) => animation.frame(i));
    keep({ transfer: use, mesh: identity, frames: shown, animation });
    return answer(shown, animation.report);
  } catch (error) {
    animation.close();
    throw error;
  }
}

function startOf(animation, request, use, others) {
  try {
    expectSure(request, use, animation.start(request.poses[0], others).confidence);
  } catch (error) {
    if (error.code === 'not_recognised') expectSure(request, use, 0);
    throw error;
  }
}

function save({ format, frame, clip, fps }) {
  if (!made) throw new NptError('nothing to save yet', 'argument');
  if (made.motion && ['glb', 'vrm', 'bvh'].includes(format)) return made.motion.write(format);
  if (made.animation && format === 'glb') return made.animation.write({ clip, fps });
  return made.mesh.write(format, { positions: made.frames[Math.min(frame, made.frames.length - 1)], transfer: made.transfer });
}

// ---- messages ----

const answers = { open, drop, frames, transfer, save };
let queue = Promise.resolve();

async function answer(id, name, request) {
  try {
    postMessage({ id, value: await answers[name](request) });
  } catch (error) {
    const kind = error instanceof Stopped ? 'stopped' : error instanceof NptError ? error.kind : error instanceof RangeError ? 'memory' : 'internal';
    const { code, remedy, report } = error;
    postMessage({ id, error: { kind, message: String(error.message ?? error), code, remedy, report } });
  }
}

// One after another; what ends a transfer doesn't wait.
onmessage = ({ data: { id, name, ...request } }) => {
  if (name === 'stop' || name === 'transfer') run += 1;
  if (name === 'stop') return;
  if (name === 'transfer') request.own = run;
  queue = queue.then(() => answer(id, name, request));
};
