// What computes: the package, in a thread of its own. Requests come as { id, name, ... }, answers go as { id, value } or { id, error },
// progress as { progress, share }. One transfer runs at a time; another request for one ends it at its next step.
import { Mesh, NptError, PoseTransfer, load } from './npt/index.js';
import { samples } from './samples.js';

load().catch(() => {});  // the first request says what went wrong

// ---- what is kept ----

const meshes = new Map();  // by key
let opened = null;         // { key, transfer }: of one weights file and its options
let prepared = null;       // { key, identity }: the identity that was transferred to last
let made = null;           // { transfer, mesh, frames, sequence }: what can be saved
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
  if (source.truth) {  // the shape of one sample in the pose of another
    const [shape, pose] = source.truth.map((key) => samples[key].mesh);
    const angles = pose.frames ? pose.frames[source.frame].angles : null;
    return Mesh.mannequin({ ...shape, pose: pose.pose, poseSeed: pose.poseSeed, angles, name: 'truth' });
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

// Positions of a frame: a mesh of a list, a step of a sample, or a moment of a clip.
function moved(positions, shift) {
  if (!shift) return positions;
  for (let i = 0; i < positions.length; ++i) positions[i] += shift[i % 3];
  return positions;
}

async function open({ key, source }) {
  const mesh = await makeMesh(source);
  drop({ key });
  meshes.set(key, mesh);
  return shownOf(mesh);
}

function drop({ key }) {
  const mesh = meshes.get(key);
  if (!mesh) return;
  if (prepared && prepared.mesh === mesh) prepared.identity.close(), prepared = null;
  meshes.delete(key);
  if (!made || made.mesh !== mesh) mesh.close();
}

// All frames of a pose for showing, and how each is brought about.
async function frames({ key, source, clip, fps }) {
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
  const count = Math.max(1, Math.floor(mesh.clips[clip].length * fps + 1e-6) + 1);
  if (count > 2000) throw new NptError(`${mesh.name}: ${count} frames at ${fps} a second, expected at most 2000`, 'input');
  const shown = [];
  for (let i = 0; i < count; ++i) {
    mesh.moveTo(clip, Math.min(i / fps, mesh.clips[clip].length));
    shown.push(mesh.positions);
    if (i % 16 === 15) {
      progress('Reading the clip', i / count);
      await breathe();
    }
  }
  return shown;
}

// ---- transfers ----

async function transferOf({ weights, file, options }) {
  const key = JSON.stringify([weights, file && file.name, file && file.key, options]);
  if (opened && opened.key === key) return opened.transfer;
  progress('Loading weights', 0);
  const bytes = file ? file.bytes : await shipped(weights === 'auto' ? 'human' : weights);
  // Weights of people go with the reader; which ones that are is what they say themselves.
  const alone = weights !== 'auto' && weights !== 'file';
  const header = new TextDecoder().decode(bytes.subarray(8, 8 + Math.min(65536, bytes.length - 8)));
  const reader = !alone && header.includes('"reader"') ? await shipped('readers/human') : null;
  progress('Opening weights');
  await breathe();
  const transfer = await PoseTransfer.open(bytes, { ...options, reader, name: file ? file.name : `${weights}.safetensors` });
  if (prepared) prepared.identity.close(), prepared = null;
  if (opened && !(made && made.transfer === opened.transfer)) opened.transfer.close();
  opened = { key, transfer };
  return transfer;
}

// A result that can be saved, with all that this needs, until another one takes its place.
function keep(next) {
  const last = made;
  made = next;
  if (!last) return;
  if (last.sequence) last.sequence.close();
  if (last.mesh !== next.mesh && !isKept(last.mesh)) last.mesh.close();
  if (last.transfer !== next.transfer && last.transfer !== opened.transfer) last.transfer.close();
}
const isKept = (mesh) => [...meshes.values()].includes(mesh);

async function transfer({ own, ...request }) {
  const wanted = async () => {
    await breathe();
    if (own !== run) throw new Stopped();
  };
  const start = performance.now();
  const use = await transferOf(request);
  await wanted();
  const identity = meshes.get(request.identity);
  if (!prepared || prepared.mesh !== identity || prepared.transfer !== use) {
    progress(`Reading ${identity.name}`);
    await wanted();
    const next = use.prepareIdentity(identity);
    if (prepared) prepared.identity.close();
    prepared = { mesh: identity, transfer: use, identity: next };
  }
  const { poses } = request;  // [{ positions, triangles, name }]
  if (poses.length === 1) {
    progress(`Reading ${poses[0].name}`);
    await wanted();
    const pose = use.preparePose(poses[0], identity.vertexCount);
    try {
      progress('Posing');
      await wanted();
      const { positions, report } = use.run(prepared.identity, pose);
      keep({ transfer: use, mesh: identity, frames: [positions], sequence: null });
      return { frames: [positions], report, seconds: (performance.now() - start) / 1000, unit: use.unitOf(identity), threads: use.threads };
    } finally {
      pose.close();
    }
  }
  const sequence = use.openSequence(prepared.identity);
  try {
    for (let i = 0; i < poses.length; ++i) {
      progress(`Frame ${i + 1} of ${poses.length}`, i / poses.length);
      await wanted();
      sequence.add(poses[i]);
    }
    if (request.along) sequence.followRoot();
    const shown = poses.map((_, i) => sequence.frame(i));
    const report = sequence.reports.reduce((worst, r) =>
      (Math.min(r.identityTrust, r.poseTrust) < Math.min(worst.identityTrust, worst.poseTrust) ? r : worst));
    keep({ transfer: use, mesh: identity, frames: shown, sequence });
    return { frames: shown, report, seconds: (performance.now() - start) / 1000, unit: use.unitOf(identity), threads: use.threads };
  } catch (error) {
    sequence.close();
    throw error;
  }
}

function save({ format, frame, clip, fps }) {
  if (!made) throw new NptError('nothing to save yet', 'argument');
  if (made.sequence && format === 'glb') return made.sequence.write({ clip, fps });
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
    postMessage({ id, error: { kind, message: String(error.message ?? error), report: error.report } });
  }
}

// One after another; what ends a transfer doesn't wait.
onmessage = ({ data: { id, name, ...request } }) => {
  if (name === 'stop' || name === 'transfer') run += 1;
  if (name === 'stop') return;
  if (name === 'transfer') request.own = run;
  queue = queue.then(() => answer(id, name, request));
};
