// The page: what is chosen, shown and saved. worker.js computes.
import { Panel, Studio } from './studio.js';
import { samples } from './samples.js';

const { calm, element } = npt;
const ownNames = /\.(obj|ply|glb|gltf|vrm|off|bvh|fbx)$/i;
const foreignNames = /\.(dae|stl|blend)$/i;
const colours = { identity: '#9db7d5', pose: '#e3c9a0', result: '#9db7d5' };

// ---- the worker ----

let worker = null, requests = new Map(), last = 0;

function startWorker() {
  worker = new Worker(new URL('worker.js', import.meta.url), { type: 'module' });
  worker.onmessage = ({ data }) => {
    if (data.progress !== undefined) return doing(data.progress, data.share);
    const request = requests.get(data.id);
    requests.delete(data.id);
    if (!request) return;
    if (data.error) request.fail(Object.assign(new Error(data.error.message), data.error));
    else request.done(data.value);
  };
  worker.onerror = (event) => {
    event.preventDefault();
    for (const request of requests.values())
      request.fail(Object.assign(new Error(event.message || 'the part that computes could not be loaded'), { kind: 'internal' }));
    requests.clear();
    worker.terminate();
    worker = null;
  };
}

function ask(name, request = {}) {
  if (!worker) {
    startWorker();
    for (const side of [state.identity, state.pose]) if (side) side.known = false;
  }
  const id = ++last;
  worker.postMessage({ id, name, ...request });
  return new Promise((done, fail) => { requests.set(id, { done, fail }); });
}

// ---- what is there ----

// A side: { key, source, name, vertexCount, faceCount, clips, triangles, frames, clip, followRoot }. Nothing is replaced before its successor is whole.
const state = { identity: null, pose: null, result: null, groundTruth: null };
let studio = null, keys = 0, turn = 0, weightsFile = null, chosenWeights = 'auto';

const fps = () => Math.max(1, Math.min(60, Number(element('fps').value) || 24));
const player = new npt.Player({
  fps,
  show: (_, frame) => {
    if (frame === studio.frame) return;
    studio.setFrame(frame);
    if (['moved', 'ground-truth', 'file'].includes(element('compare').value)) paint();
  },
});

function doing(text, share = null) {
  element('progress').hidden = text === '';
  element('doing').textContent = text;
  element('share').hidden = share === null;
  if (share !== null) element('share').value = share;
  element('stop').hidden = !transferring;
}

function notice(text) {
  element('notice-text').textContent = text;
  element('notice').hidden = text === '';
}

// What a visitor can do about a warning or an error, by its code.
const remedies = {
  look_at_result: 'Look at the result before using it',
  choose_method: 'The weights “human, the network alone” give the network\'s result all the same',
  give_unit: 'Choose its unit under Options',
  give_weights: 'Of the files that weights name, this page has human.safetensors alone',
};

function words(error) {
  if (error.kind === 'memory')
    return 'There is not enough memory for this in a browser tab. What is shown stays; a smaller mesh, or fewer frames, will do.';
  if (error.kind === 'internal' && /SIMD|CompileError|WebAssembly|exception/i.test(error.message))
    return `This browser can't run it (Chrome 95, Firefox 114, Safari 16.4 or later can): ${error.message}`;
  if (weightsFile && error.message.startsWith(weightsFile.name))
    return `These are no weights of a pose transfer network that could be used. ${error.message}`;
  const remedy = remedies[error.remedy];
  return remedy ? `${error.message}. ${remedy}` : error.message;
}

async function guarded(f) {
  try {
    return await f();
  } catch (error) {
    if (error.kind === 'stopped') return null;
    if (error.kind === undefined) console.error(error);
    // After a trap the module's memory may be broken: another one begins with what is on show.
    if (error.kind === 'internal' && error.message.startsWith('npt stopped') && worker) worker.terminate(), worker = null;
    notice(words(error));
    doing('');
    return null;
  } finally {
    settle();
  }
}

// For those who wait for a picture: nothing is going on.
let going = 0;
function settle() { document.documentElement.dataset.ready = going === 0 && studio ? 'yes' : ''; }
async function work(f) {
  going += 1;
  document.documentElement.dataset.ready = '';
  try {
    return await guarded(f);
  } finally {
    going -= 1;
    settle();
  }
}

// ---- meshes ----

function count(n, what) { return `${n.toLocaleString('en')} ${what}${n === 1 ? '' : 's'}`; }

function describe(side) {
  const parts = side.vertexCount > 0 ? [count(side.vertexCount, 'vertex').replace('vertexs', 'vertices'), count(side.faceCount, 'face')] : [];
  if (side.jointCount > 0) parts.push(count(side.jointCount, 'joint'));
  if (side.frames.length > 1) parts.push(count(side.frames.length, 'frame'));
  return [parts.join(', '), side.source.lost].filter(Boolean).join('. ');
}

async function readSide(source, clip) {
  const key = ++keys;
  if (source.list) {
    // A sequence of files: each is read as the first one was.
    const frames = [];
    let first = null;
    for (const [i, one] of source.list.entries()) {
      doing(`Reading ${one.name}`, i / source.list.length);
      const mesh = await ask('open', { key: -1, source: one });
      first ??= mesh;
      frames.push({ positions: mesh.positions, triangles: mesh.triangles, name: mesh.name });
    }
    await ask('drop', { key: -1 });
    return { key, source, ...first, name: `${first.name} and ${frames.length - 1} more`, frames, clips: [], clip: null, followRoot: false, known: true };
  }
  doing(`Reading ${source.name ?? samples[source.sample].name}`);
  const mesh = await ask('open', { key, source });
  const lasting = mesh.clips.findIndex(({ length }) => length > 0.1);  // some files begin with a clip of one pose
  const chosen = clip !== undefined ? clip : mesh.clips.length > 0 ? Math.max(0, lasting) : null;
  const side = { key, source, ...mesh, clip: null, followRoot: false, known: true };
  if (chosen !== null || (source.sample && samples[source.sample].mesh.frames)) {
    side.clip = chosen;
    side.followRoot = true;  // as npt transfer --clip does
    const { frames, ...rest } = await ask('frames', { key, source, clip: chosen, fps: fps() });
    Object.assign(side, rest);
    side.frames = frames.map((positions) => ({ positions, triangles: side.triangles, name: mesh.name }));
  } else {
    side.frames = [{ positions: mesh.positions, triangles: mesh.triangles, name: mesh.name }];
  }
  return side;
}

async function setSide(name, source, clip) {
  notice('');
  worker?.postMessage({ name: 'stop' });
  await work(async () => {
    const side = await readSide(source, name === 'identity' ? null : clip);
    const before = state[name];
    state[name] = side;
    state.result = state.groundTruth = null;
    if (before && before.key !== side.key) ask('drop', { key: before.key });
    element(`${name}-said`).textContent = `${side.source.sample ? '' : `${side.name}: `}${describe(side)}`;
    const select = element(`${name}-sample`);
    const own = [...select.options].find((option) => option.value === 'file');
    own.hidden = own.disabled = !side.source.bytes && !side.source.list;
    if (!own.hidden) own.textContent = side.name;
    select.value = side.source.sample ?? 'file';
    if (name === 'pose') {
      element('clips').hidden = side.clips.length === 0;
      element('clip').replaceChildren(...side.clips.map((c, i) => new Option(`${c.name || `clip ${i + 1}`} (${c.length.toFixed(1)} s)`, i)), new Option('as it stands', ''));
      element('clip').value = side.clip ?? '';
    }
    if (!state.identity || !state.pose) return;
    showPanels(true);
  });
  if (state.identity && state.pose && !state.result) await startTransfer();
}

// ---- the transfer ----

let transferring = false;

function optionsOf() {
  return {
    method: element('weights').value === 'auto' || element('weights').value === 'file' ? 'automatic' : 'network',
    pairings: Math.max(1, Math.min(32, Math.round(Number(element('pairings').value) || 1))),
    mirror: element('mirror').checked, refine: element('refine').checked, unit: Number(element('unit').value),
    figure: Math.max(0, Math.min(99, Math.round(Number(element('figure').value) || 0))),
  };
}

const motionOptionsOf = () => ({ inPlace: element('in-place').checked, footLock: element('foot-lock').checked });

async function startTransfer() {
  const own = ++turn;
  notice('');
  transferring = true;
  await work(async () => {
    try {
      doing('Starting');
      const { identity, pose } = state;
      for (const side of [identity, pose]) {
        if (side.known || side.source.list) continue;
        await ask('open', { key: side.key, source: side.source });
        side.known = true;
      }
      const result = await ask('transfer', {
        identity: identity.key, poses: pose.frames, followRoot: pose.followRoot, weights: element('weights').value,
        rest: pose.clip === null ? null : { positions: pose.positions, triangles: pose.triangles, name: pose.name },
        file: element('weights').value === 'file' ? weightsFile : null, options: optionsOf(),
        pose: pose.key, source: pose.source, clip: pose.clip, fps: fps(), motion: motionOptionsOf(),
      });
      if (own !== turn) return;
      state.result = result;
      transferring = false;
      doing('');
      report(result);
      await findGroundTruth();
      showPanels(false);
      player.setPlaying(!calm);
    } finally {
      if (own === turn) {
        transferring = false;
        if (!state.result) element('result-said').textContent = 'None: what went wrong stands above the picture';
        element('stop').hidden = true;
        element('save').disabled = !state.result;
        if (element('doing').textContent !== '' && state.result) doing('');
      }
    }
  });
}

const percent = (share) => `${Math.round(100 * share)} %`;
const inShort = ({ report: how }) => (how.method === 'network' ? 'by the network' : `confidence ${percent(how.confidence)}`);
const ways = {
  network: () => 'By the network',
  body: ({ kind, confidence }) => `${kind[0].toUpperCase()}${kind.slice(1)} by body estimation, confidence ${percent(confidence)}`,
  joints: ({ confidence, ownJoints }) => `On ${ownJoints ? 'its own joints' : 'joints of its estimated body'}, confidence ${percent(confidence)}`,
};

function report({ report: how, seconds, threads }) {
  const time = `${seconds.toFixed(1)} s${threads > 1 ? ` on ${threads} threads` : ''}`;
  element('result-said').textContent = `${ways[how.method](how)}, ${time}`;
  element('format').querySelector('[value=bvh]').disabled = how.method !== 'joints';
  if (how.method !== 'joints' && element('format').value === 'bvh') element('format').value = 'glb';
  // A unit that was chosen isn't assumed.
  const warnings = how.warnings.filter(({ code }) => code !== 'unit_assumed' || Number(element('unit').value) === 0);
  const notes = warnings.map(({ text }) => text);
  for (const remedy of new Set(warnings.map((warning) => warning.remedy))) if (remedies[remedy]) notes.push(remedies[remedy]);
  element('notes').replaceChildren(...notes.map((text) => Object.assign(document.createElement('li'), { textContent: text })));
}

// ---- the picture ----

function showPanels(aim) {
  const { identity, pose, result } = state;
  const panel = (side, caption, frames, colour) => ({
    caption, detail: side.source.sample ? samples[side.source.sample].name : side.name, colour, faces: side.triangles, frames,
  });
  const panels = [
    panel(identity, 'Identity', [identity.positions], colours.identity),
    panel(pose, 'Pose', pose.frames.map((frame) => frame.positions), colours.pose),
  ];
  // Until there is a result, its place is kept. A skeleton alone has bones as a mesh.
  panels.push({ ...panel(identity, 'Result', result ? result.frames : [identity.positions], result ? colours.result : '#c9cdd0'),
                faces: result?.triangles ?? identity.triangles });
  panels[2].detail = result ? inShort(result) : '';
  if (!result) element('notes').replaceChildren(), element('result-said').textContent = 'Not yet';
  // Frames of other triangles are no movement that one panel can show: those that fit are.
  panels[1].frames = panels[1].frames.filter((frame) => frame.length === panels[1].frames[0].length);
  const frame = aim ? 0 : Math.min(studio.frame, Math.max(...panels.map((p) => p.frames.length)) - 1);
  studio.show(panels.map((description) => new Panel(description)), aim);
  element('save').disabled = !result;
  player.setFrames(studio.frames);
  player.setFrame(frame);
  compare();
}

// ---- comparing ----

// The ground truth of two samples: the identity's shape in the pose's angles.
async function findGroundTruth() {
  state.groundTruth = null;
  const { identity, pose } = state;
  element('compare').querySelector('[value=ground-truth]').disabled = !(identity.source.sample && pose.source.sample);
  if (!(identity.source.sample && pose.source.sample)) {
    if (element('compare').value === 'ground-truth') element('compare').value = 'none';
    return;
  }
  const key = ++keys, frames = [];
  for (let i = 0; i < pose.frames.length; ++i) {
    const mesh = await ask('open', { key, source: { groundTruth: [identity.source.sample, pose.source.sample], frame: i } });
    frames.push(mesh.positions);
  }
  ask('drop', { key });
  state.groundTruth = frames;
}

const centreOf = (xyz) => [0, 1, 2].map((k) => {
  let low = Infinity, high = -Infinity;
  for (let i = k; i < xyz.length; i += 3) low = Math.min(low, xyz[i]), high = Math.max(high, xyz[i]);
  return (low + high) / 2;
});

// [V] distances of two meshes whose boxes are centred, as the protocol measures them.
function distances(a, b) {
  const from = centreOf(a), to = centreOf(b), values = new Float32Array(a.length / 3);
  for (let v = 0; v < values.length; ++v)
    values[v] = Math.hypot(...[0, 1, 2].map((k) => a[3 * v + k] - from[k] - b[3 * v + k] + to[k]));
  return values;
}

let against = null;  // a file to compare with

function paint() {
  const how = element('compare').value, result = state.result;
  const other = !result ? null : how === 'moved' ? [state.identity.positions] : how === 'ground-truth' ? state.groundTruth : how === 'file' ? against : null;
  element('legend').hidden = !other;
  if (!other) return studio.setHeat(null);
  const own = result.frames[Math.min(studio.frame, result.frames.length - 1)];
  const theirs = other[Math.min(studio.frame, other.length - 1)];
  const values = distances(own, theirs);
  const unit = 1000 * (result.unit || 1);
  const sorted = [...values].sort((a, b) => a - b), most = sorted[Math.floor(0.99 * (sorted.length - 1))] * unit;
  const steps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000], high = steps.find((step) => step >= most) ?? 5000;
  element('legend-label').textContent = how === 'moved' ? 'moved' : how === 'ground-truth' ? 'distance to the ground truth' : 'distance to the file';
  element('legend-high').textContent = `${high} mm`;
  studio.setHeat({ values, unit, high });
  const mean = values.reduce((sum, x) => sum + x, 0) / values.length * unit;
  studio.setCaptions([{}, {}, { detail: `${how === 'moved' ? 'moved' : 'off'} ${mean.toFixed(1)} mm on average` }]);
}

function compare() {
  const how = element('compare').value;
  if (how === 'file' && against && state.result && against[0].length !== state.result.frames[0].length) {
    notice(`The mesh to compare with has ${against[0].length / 3} vertices, expected ${state.result.frames[0].length / 3}: the identity's, in its order`);
    element('compare').value = 'none';
    return compare();
  }
  studio.setOverlay(how === 'overlay' && state.result !== null);
  if (state.result) studio.setCaptions([{}, {}, { detail: inShort(state.result) }]);
  paint();
}

function chooseComparison(how) {
  if (how === 'ground-truth' && !state.groundTruth) return;
  element('compare').value = element('compare').value === how ? 'none' : how;
  compare();
}

async function setComparison(source) {
  notice('');
  await work(async () => {
    const key = ++keys;
    doing(`Reading ${source.name}`);
    const mesh = await ask('open', { key, source });
    ask('drop', { key });
    doing('');
    against = [mesh.positions];
    element('compare').value = 'file';
    compare();
  });
}

// ---- files ----

async function sourceOf(file, companions) {
  const others = {};
  for (const other of companions) others[other.name] = new Uint8Array(await other.arrayBuffer());
  const bytes = new Uint8Array(await file.arrayBuffer());
  return /\.fbx$/i.test(file.name) ? fbxSource(file.name, bytes, others) : { name: file.name, bytes, others };
}

const lostOf = (names) => (names.length === 0 ? '' : `Without ${count(names.length, 'image')} that it names: ${names.slice(0, 3).join(', ')}${names.length > 3 ? ' …' : ''}`);

// An FBX file, read by three.js, as a GLB that goes the way of all others.
async function fbxSource(name, bytes, others) {
  doing(`Reading ${name}`);
  let reader;
  try {
    delete globalThis.__THREE__;  // by which three.js finds a second copy of itself, and complains: this one never meets the first
    reader = await import('./fbx.min.js');
  } catch (error) {
    throw Object.assign(new Error(`${name}: what reads FBX files could not be loaded (${error.message}); a GLB of it can be opened all the same`), { kind: 'input' });
  }
  try {
    const { bytes: glb, missing } = await reader.glbOf(bytes, others);
    return { name: `${name}.glb`, bytes: glb, others: {}, lost: lostOf(missing) };
  } catch (error) {
    throw Object.assign(new Error(`${name}: ${error.message.replace(/\.$/, '')}; Blender and the program npt also read FBX, and write it as GLB`), { kind: 'input' });
  }
}

// What these files are for a side: one mesh, or a sequence in the order of their names.
async function sourcesOf(files) {
  const all = [...files];
  const meshes = all.filter((file) => ownNames.test(file.name)).sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
  if (meshes.length === 0) {
    const foreign = all.find((file) => foreignNames.test(file.name));
    throw Object.assign(new Error(foreign
      ? `${foreign.name}: the browser reads OBJ, PLY, GLB, glTF, VRM, OFF, BVH and FBX; the program npt also reads Collada and STL, or export it as GLB`
      : `${all[0]?.name ?? 'this'}: no mesh or clip by its name, expected .obj, .ply, .glb, .gltf, .vrm, .off, .bvh or .fbx`), { kind: 'input' });
  }
  const companions = all.filter((file) => !meshes.includes(file));
  const sources = [];
  for (const file of meshes) sources.push(await sourceOf(file, companions));
  return sources;
}

async function openFiles(name, files) {
  if (files.length === 0) return;
  const sources = await work(() => sourcesOf(files));
  if (!sources) return;
  if (name === 'identity') {
    await setSide('identity', sources[0]);
    if (sources.length > 1) await setSide('pose', sources.length === 2 ? sources[1] : { list: sources.slice(1) });
  } else if (name === 'pose') {
    await setSide('pose', sources.length === 1 ? sources[0] : { list: sources });
  } else {
    await setComparison(sources[0]);
  }
}

async function openWeights(file) {
  if (file) {
    weightsFile = { key: ++keys, name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
    element('weights').querySelector('[value=file]').textContent = file.name;
    element('weights').value = 'file';
    await startTransfer();
    if (element('notice').hidden) {
      chosenWeights = 'file';
    } else {  // back to those that worked, which the result on show is of
      weightsFile = null;
      element('weights').querySelector('[value=file]').textContent = 'a file of mine';
      element('weights').value = chosenWeights;
    }
  } else if (!weightsFile) {
    element('weights').value = chosenWeights;
  }
}

async function save() {
  await work(async () => {
    const ofVrm = element('format').value === 'glb' && state.result.report.ownJoints && /\.vrm$/i.test(state.identity.name);
    const format = ofVrm ? 'vrm' : element('format').value;
    const clip = state.pose.clip === null ? (state.pose.source.sample ?? 'clip') : state.pose.clips[state.pose.clip].name;
    const bytes = await ask('save', { format, frame: studio.frame, clip, fps: fps() });
    const stem = (side) => (side.source.sample ?? side.name).replace(/(\.fbx)?\.[^.]*$/i, '').replace(/[^\p{L}\p{N}_-]+/gu, '_');
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([bytes], { type: format === 'glb' || ofVrm ? 'model/gltf-binary' : 'application/octet-stream' }));
    link.download = `${stem(state.identity)}-${stem(state.pose)}.${format}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    doing('');
  });
}

// ---- what is pressed ----

function listen() {
  for (const name of ['identity', 'pose']) {
    const select = element(`${name}-sample`);
    for (const [key, sample] of Object.entries(samples)) if (sample.role === name) select.append(new Option(sample.name, key));
    const own = new Option('a file of mine', 'file');
    own.hidden = own.disabled = true;
    select.append(own);
    select.onchange = () => { if (select.value !== 'file') setSide(name, { sample: select.value }); };
    element(`${name}-file`).onchange = (event) => {
      const files = [...event.target.files];
      event.target.value = '';
      openFiles(name, files);
    };
  }
  element('clip').onchange = () => setSide('pose', state.pose.source, element('clip').value === '' ? null : Number(element('clip').value));
  element('fps').onchange = () => { if (state.pose.clip !== null) setSide('pose', state.pose.source, state.pose.clip); };
  element('weights').onchange = () => {
    if (element('weights').value === 'file') return element('weights-file').click();
    chosenWeights = element('weights').value;
    return startTransfer();
  };
  element('weights-file').onchange = (event) => {
    const [file] = event.target.files;
    event.target.value = '';
    openWeights(file);
  };
  element('weights-file').oncancel = () => openWeights(null);
  for (const id of ['pairings', 'unit', 'figure', 'mirror', 'refine', 'in-place', 'foot-lock']) element(id).onchange = () => startTransfer();
  element('compare').onchange = () => {
    if (element('compare').value === 'file' && !against) {
      element('compare').value = 'none';
      element('comparison-file').click();
    }
    compare();
  };
  element('comparison-file').onchange = (event) => {
    const files = [...event.target.files];
    event.target.value = '';
    openFiles('comparison', files);
  };
  element('save').onclick = save;
  element('stop').onclick = () => {
    worker.postMessage({ name: 'stop' });
    element('result-said').textContent = 'Stopped';
    doing('');
  };
  element('notice-close').onclick = () => notice('');
  element('settings').onsubmit = (event) => event.preventDefault();

  // Dropped on the left third: the identity; in the middle: the pose; on the right: what to compare with.
  const thirds = ['identity', 'pose', 'comparison'], stage = element('stage');
  const third = (event) => {
    const box = stage.getBoundingClientRect();
    return Math.max(0, Math.min(2, Math.floor(3 * (event.clientX - box.left) / box.width)));
  };
  addEventListener('dragover', (event) => {
    event.preventDefault();
    element('drop').hidden = false;
    [...element('drop').children].forEach((place, i) => place.classList.toggle('here', i === third(event)));
  });
  addEventListener('dragleave', (event) => { if (!event.relatedTarget) element('drop').hidden = true; });
  addEventListener('drop', (event) => {
    event.preventDefault();
    element('drop').hidden = true;
    const files = [...event.dataTransfer.files];
    if (files.length === 1 && /\.safetensors$/i.test(files[0].name)) {
      openWeights(files[0]);
    } else {
      openFiles(thirds[third(event)], files);
    }
  });

  npt.listen(studio, player, {
    i: () => element('identity-file').click(), p: () => element('pose-file').click(),
    s: () => { if (!element('save').disabled) save(); },
    o: () => chooseComparison('overlay'), h: () => chooseComparison('ground-truth'),
  }, { INPUT: /^(Arrow|Home|End| |[0-9.,+-]$)/, SUMMARY: /^ $/ });
}

async function start() {
  npt.theme.follow();
  startWorker();
  try {
    studio = new Studio();
  } catch (error) {
    notice(`This browser shows no 3D graphics (WebGL): ${error.message}`);
  }
  listen();
  if (!studio) return;
  npt.run(studio, player);
  const identity = setSide('identity', { sample: 'character' });
  await setSide('pose', { sample: 'leap' });
  await identity;
}

start();
