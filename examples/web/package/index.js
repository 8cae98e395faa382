// npt in WebAssembly: typed arrays in and out. index.d.ts says what each part takes and gives.
const kinds = ['none', 'argument', 'input', 'memory', 'internal'];

/** What can't be done: the library's message, whether it is the caller's, the input's or the memory's doing, and what can be done about it. */
export class NptError extends Error {
  constructor(message, kind, { code = 'bad_input', remedy = 'none', ...options } = {}) {
    super(message, options);
    this.name = 'NptError';
    this.kind = kind;
    this.code = code;
    this.remedy = remedy;
  }
}

const bad = (message) => new NptError(message, 'argument');

// ---- the module ----

let loading = null;   // Promise of the module
let module_ = null;   // the module, once it is there
let memory_ = null;   // its memory, whose buffer is another one whenever it has grown
let threads_ = 1;

// Threads want memory that is shared, which a server's headers allow, and a thread that may wait.
const mayShare = () => globalThis.crossOriginIsolated === true && typeof WorkerGlobalScope !== 'undefined' && globalThis instanceof WorkerGlobalScope;

async function compiled(wasm, name) {
  if (wasm instanceof WebAssembly.Module) return wasm;
  if (wasm instanceof ArrayBuffer || ArrayBuffer.isView(wasm)) return WebAssembly.compile(wasm);
  const url = new URL(wasm ?? name, import.meta.url);
  if (url.protocol === 'file:') {
    const { readFile } = await import('node:fs/promises');
    return WebAssembly.compile(await readFile(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new NptError(`${url}: ${response.status} ${response.statusText}`, 'input');
  // A server that doesn't know the type of .wasm files is no obstacle.
  if (/^application\/wasm/.test(response.headers.get('content-type') ?? '')) return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

async function start(wasm, threads) {
  const name = threads > 1 ? 'threads' : 'single';
  const [code, { default: createModule }] = await Promise.all([compiled(wasm, `npt-${name}.wasm`), import(`./npt-${name}.js`)]);
  let memory = null;
  const started = await new Promise((done, fail) => {
    createModule({
      pool: poolOf(threads),
      instantiateWasm(imports, use) {
        WebAssembly.instantiate(code, imports).then((instance) => {
          const all = [...Object.values(instance.exports), ...Object.values(imports).flatMap((from) => Object.values(from))];
          memory = all.find((value) => value instanceof WebAssembly.Memory);
          use(instance, code);
        }).catch(fail);
        return {};
      },
      print() {}, printErr() {},
    }).then(done, fail);
  });
  module_ = started, memory_ = memory, threads_ = threads;
}

/** Loads the module, once. `wasm`: where npt-single.wasm is, its bytes, or a WebAssembly.Module; without: beside this file. */
export function load({ wasm, threads = 0 } = {}) {
  const wanted = Math.min(threads || globalThis.navigator?.hardwareConcurrency || 1, 4);
  const shared = wasm === undefined && wanted > 1 && mayShare();
  // Shared memory is asked for in one piece, which a phone may not have: one thread does without.
  loading ??= (shared ? start(wasm, wanted).catch(() => start(wasm, 1)) : start(wasm, 1)).catch((error) => {
    loading = null;
    throw error;
  });
  return loading;
}

// Each transfer has threads for its network and as many for body estimation; there are those for two. They are started with the module, since
// a thread that waits for another can't start it.
const poolOf = (threads) => 4 * (threads - 1);
let taken = 0;  // of the pool, by transfers that are open

/** Threads of a transfer that is opened now: 1 where memory can't be shared, or others have taken them. */
export const threads = () => (taken + 2 * (threads_ - 1) <= poolOf(threads_) ? threads_ : 1);

const bytes_ = () => new Uint8Array(memory_.buffer);

/** The version of npt, such as "1.0.0". */
export async function version() {
  await load();
  return module_.UTF8ToString(module_._web_version());
}

/** Bytes of memory that the module holds. It grows as needed, to 2 GB at most, and never shrinks. */
export const memory = () => (memory_ ? memory_.buffer.byteLength : 0);

function failure() {
  return new NptError(textFrom(module_._web_error()), kinds[module_._web_error_kind()] ?? 'internal',
    { code: textFrom(module_._web_error_code()), remedy: textFrom(module_._web_error_remedy()) });
}

// What a function of the module returns, or its error. A trap is a mistake in the library: it says so.
function call(name, ...words) {
  let result;
  try {
    result = module_[`_web_${name}`](...words);
  } catch (error) {
    if (error instanceof NptError) throw error;
    throw new NptError(`npt stopped in ${name}: ${error.message ?? error}`, 'internal', { cause: error });
  }
  if (result === 0) throw failure();
  return result;
}

const textFrom = (pointer) => module_.UTF8ToString(pointer);

function allocate(bytes) {
  const pointer = module_._malloc(Math.max(1, bytes));
  if (pointer === 0) throw new NptError('out of memory', 'memory');
  return pointer;
}

// f(pointers...) with texts and arrays in the module's memory, which is freed afterwards.
function lent(values, f) {
  const pointers = [];
  try {
    for (const value of values) {
      if (value === null) {
        pointers.push(0);
      } else if (typeof value === 'string') {
        const bytes = module_.lengthBytesUTF8(value) + 1;
        pointers.push(allocate(bytes));
        module_.stringToUTF8(value, pointers.at(-1), bytes);
      } else {
        pointers.push(allocate(value.byteLength));
        bytes_().set(new Uint8Array(value.buffer, value.byteOffset, value.byteLength), pointers.at(-1));
      }
    }
    return f(...pointers);
  } finally {
    for (const pointer of pointers) if (pointer !== 0) module_._free(pointer);
  }
}

const floatsAt = (pointer, count) => new Float32Array(memory_.buffer, pointer, count).slice();

// ---- files ----

const asBytes = (bytes, what) => {
  if (bytes instanceof ArrayBuffer) return new Uint8Array(bytes);
  if (ArrayBuffer.isView(bytes)) return new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  throw bad(`${what}: bytes are wanted, an ArrayBuffer or a typed array`);
};

// A name for one file in a folder of its own.
const fileName = (name) => {
  const last = String(name ?? '').split(/[\\/]/).at(-1).replace(/[\u0000-\u001f]/g, '_');
  return last === '' || last === '.' || last === '..' ? 'mesh' : last;
};

let folders = 0;

// f() in a folder with these files, which then goes away. Names in messages are those that the caller knows.
function inFolder(files, f) {
  const { FS } = module_;
  const folder = `/npt-${folders++}`;
  FS.mkdir(folder);
  FS.chdir(folder);
  try {
    for (const [name, bytes] of files) {
      const parts = name.split('/');
      for (let i = 1; i < parts.length; ++i) {
        const part = parts.slice(0, i).join('/');
        if (!FS.analyzePath(part).exists) FS.mkdir(part);
      }
      FS.writeFile(name, bytes, { canOwn: false });
    }
    return f();
  } catch (error) {
    if (error instanceof NptError) throw error;
    if (error instanceof RangeError) throw new NptError('out of memory', 'memory', { cause: error });
    throw new NptError(String(error.message ?? error), 'internal', { cause: error });
  } finally {
    FS.chdir('/');
    remove(folder);
  }
}

function remove(path) {
  const { FS } = module_;
  if (!FS.isDir(FS.stat(path).mode)) return FS.unlink(path);
  for (const name of FS.readdir(path)) if (name !== '.' && name !== '..') remove(`${path}/${name}`);
  return FS.rmdir(path);
}

// ---- handles ----

// Something that lives in the module's memory. It is freed when it is closed and all that was made of it is.
class Handle {
  #pointer;
  #release;
  #parents;
  #users = 1;
  #closed = false;
  constructor(pointer, release, parents = []) {
    this.#pointer = pointer;
    this.#release = release;
    this.#parents = parents;
    for (const parent of parents) parent.#users += 1;
  }
  get pointer_() {
    if (this.#closed) throw bad(`${this.constructor.name}: used after close()`);
    return this.#pointer;
  }
  get closed() { return this.#closed; }
  close() {
    if (this.#closed) return;
    this.#closed = true;
    this.#leave();
  }
  [Symbol.dispose ?? Symbol.for('Symbol.dispose')]() { this.close(); }
  #leave() {
    this.#users -= 1;
    if (this.#users > 0) return;
    module_[`_web_${this.#release}`](this.#pointer);
    // Threads come back to the pool by a message.
    if (this.#release === 'close') setTimeout(() => { taken -= 2 * (this.threads - 1); }, 100);
    for (const parent of this.#parents) parent.#leave();
  }
}

/** A mesh in the module's memory, with all that its file holds, so that it can be written again. */
export class Mesh extends Handle {
  constructor(pointer) {
    super(pointer, 'release_mesh');
    const { name, vertices, faces, triangles, clips } = JSON.parse(textFrom(call('mesh_info', pointer)));
    Object.assign(this, { name, vertexCount: vertices, faceCount: faces, triangleCount: triangles, clips });
  }

  /** Reads OBJ, PLY, GLB, glTF or OFF: the format is that of the name's extension. */
  static async read(bytes, name, others = {}) {
    await load();
    const own = fileName(name);
    const files = Object.entries(others).map(([other, content]) => [other.replace(/^\.?\//, ''), asBytes(content, other)]);
    files.push([own, asBytes(bytes, own)]);
    return new Mesh(inFolder(files, () => lent([own], (path) => call('read', path, path))));
  }

  /** A mesh of positions [3 V] and triangles [3 T]. */
  static async from({ positions, triangles = null, name = 'mesh' }) {
    await load();
    return made({ positions, triangles, name });
  }

  /** The built-in mannequin; the same seeds give the same mesh as `npt generate` does. */
  static async mannequin({ shapeSeed = 0, proportions = false, pose = 'rest', poseSeed = 0, angles = null, name = 'mannequin' } = {}) {
    await load();
    const kind = ['rest', 'random', 'wide', 'natural'].indexOf(pose);
    if (kind < 0) throw bad(`pose '${pose}': rest, random, wide or natural`);
    if (angles !== null && angles.length !== 72) throw bad(`angles: ${angles.length} numbers, expected 72`);
    return new Mesh(lent([name, angles === null ? null : Float32Array.from(angles)], (text, numbers) =>
      call('mannequin', text, shapeSeed, proportions ? 1 : 0, kind, poseSeed, numbers)));
  }

  get positions() { return floatsAt(module_._web_positions(this.pointer_), 3 * this.vertexCount); }
  get triangles() {
    return new Uint32Array(memory_.buffer, module_._web_triangles(this.pointer_), 3 * this.triangleCount).slice();
  }

  /** Moves the mesh to a time, in seconds, of one of its clips; clip null: as its file has it at rest. */
  moveTo(clip, time = 0) {
    if (clip !== null && !this.clips[clip]) throw bad(`clip ${clip}: ${this.name} has ${this.clips.length}`);
    call('move', this.pointer_, clip ?? -1, time);
  }

  /** The times, in seconds, of a clip's frames. */
  frameTimes(clip, fps = 30) {
    if (!this.clips[clip]) throw bad(`clip ${clip}: ${this.name} has ${this.clips.length}`);
    return JSON.parse(textFrom(call('frame_times', this.pointer_, clip, fps)));
  }

  /** The bytes of a file: this mesh with all that came with it, in `positions` where they are given. */
  write(format, { positions = null, transfer = null } = {}) {
    if (!['obj', 'ply', 'glb'].includes(format)) throw bad(`format '${format}': obj, ply or glb`);
    if (positions !== null && positions.length !== 3 * this.vertexCount)
      throw bad(`positions: ${positions.length} numbers, expected ${3 * this.vertexCount}`);
    const file = `result.${format}`;
    return inFolder([], () => {
      lent([positions === null ? null : asFloats(positions), file], (xyz, path) =>
        call('write', transfer === null ? 0 : transfer.pointer_, this.pointer_, xyz, path));
      return module_.FS.readFile(file);
    });
  }
}

const asFloats = (numbers) => (numbers instanceof Float32Array ? numbers : Float32Array.from(numbers));

function made({ positions, triangles = null, name = 'mesh' }) {
  if (!positions || positions.length === undefined || positions.length % 3 !== 0)
    throw bad(`${name}: positions are three numbers a vertex`);
  if (triangles !== null && triangles.length % 3 !== 0) throw bad(`${name}: triangles are three vertex numbers each`);
  const faces = triangles === null ? null : triangles instanceof Uint32Array ? triangles : Uint32Array.from(triangles);
  return new Mesh(lent([name, asFloats(positions), faces], (text, xyz, corners) =>
    call('make', text, xyz, positions.length / 3, corners, faces === null ? 0 : faces.length / 3)));
}

const infoOf = (what, pointer) => JSON.parse(textFrom(call(`${what}_info`, pointer)));

/** An identity that takes many poses: what depends on it alone is computed once. */
class Character extends Handle {
  constructor(transfer, mesh, pointer = call('character', transfer.pointer_, mesh.pointer_)) {
    super(pointer, 'release_character', [transfer, mesh]);
    this.transfer = transfer;
    this.mesh = mesh;
    Object.assign(this, infoOf('character', pointer));
  }

  /** The bytes of a file from which `transfer.loadCharacter` makes it again. */
  save() {
    return inFolder([], () => {
      lent(['character.safetensors'], (path) => call('save_character', this.pointer_, path));
      return module_.FS.readFile('character.safetensors');
    });
  }
}

/** A pose that many characters take. */
class Pose extends Handle {
  constructor(transfer, pointer) {
    super(pointer, 'release_pose', [transfer]);
    this.transfer = transfer;
    Object.assign(this, infoOf('pose', pointer));
  }
}

/** The poses of a sequence: bodies are followed from frame to frame. */
class PoseTracker extends Handle {
  constructor(transfer) {
    super(call('open_tracker', transfer.pointer_), 'close_tracker', [transfer]);
    this.transfer = transfer;
  }

  /** The next frame's pose, for characters of so many vertices. */
  next(frame, characterVertices) {
    return borrowed(frame, 'pose', (mesh) => new Pose(this.transfer, call('next_pose', this.pointer_, mesh.pointer_, characterVertices)));
  }
}

/** Which frames of a sequence beside the first are worth a try for its start: spread over it. */
export function framesToTry(count) {
  const tries = Math.min(Math.max(count - 1, 0), 3);
  return Array.from({ length: tries }, (_, i) => Math.floor(count * (i + 1) / (tries + 1)));
}

/** A sequence on one character: add the frames one after another, then finish. */
class Animation extends Handle {
  constructor(character) {
    super(call('open_animation', character.pointer_), 'close_animation', [character]);
    this.character = character;
    this.reports = [];
    this.finished = false;
  }

  /** Frames so far. */
  get length() { return this.reports.length; }
  /** Of the frame with the lowest confidence, whose number is `weakest`. */
  get report() { return this.reports[this.weakest]; }
  get weakest() { return module_._web_weakest_frame(this.pointer_); }

  /** Transfers the first frame. `others`: meshes with the same triangles, such as further frames or a rig at rest: where the first frame isn't
   * recognised with high confidence, the sequence is followed from the one of them that is recognised best. */
  start(first, others = []) {
    if (this.length > 0) throw bad('start: the animation has frames already');
    return borrowed(first, 'pose', (mesh) => {
      const own = [];
      try {
        for (const other of others) {
          try {
            own.push(other instanceof Mesh ? other : made({ name: 'pose', ...other }));
          } catch (error) {
            if (error.kind !== 'input') throw error;  // left to whoever adds that frame
          }
        }
        const pointers = Uint32Array.from(own, (one) => one.pointer_);
        return this.#added(lent([pointers], (list) => call('start_animation', this.pointer_, mesh.pointer_, list, own.length)));
      } finally {
        for (const one of own) if (!others.includes(one)) one.close();
      }
    });
  }

  /** Transfers the next frame. */
  add(frame) {
    if (this.finished) throw bad('add: the animation is finished');
    return borrowed(frame, 'pose', (mesh) => this.#added(call('add_frame', this.pointer_, mesh.pointer_)));
  }

  /** After the last frame. `followRoot`: along the poses' root trajectory, in proportion to the character's legs, as `npt transfer --clip` does. */
  finish({ followRoot = true } = {}) {
    if (this.length === 0 || this.finished) throw bad(`finish: the animation ${this.finished ? 'is finished' : 'has no frames'}`);
    call('finish_animation', this.pointer_, followRoot ? 1 : 0);
    this.finished = true;
    return this;
  }

  /** Positions [3 V] of frame i. */
  frame(i) { return floatsAt(call('frame', this.pointer_, i), 3 * this.character.mesh.vertexCount); }

  /** A GLB that moves: on a skeleton where every frame was made by body estimation, else frame by frame. */
  write({ clip = 'clip', fps = 30, times = null } = {}) {
    if (!this.finished) this.finish();
    const seconds = Float64Array.from(times ?? Array.from({ length: this.length }, (_, i) => i / fps));
    if (seconds.length !== this.length) throw bad(`times: ${seconds.length}, expected ${this.length}`);
    return inFolder([], () => {
      lent(['result.glb', clip, seconds], (path, name, at) =>
        call('write_animation', this.pointer_, this.character.mesh.pointer_, path, name, at));
      return module_.FS.readFile('result.glb');
    });
  }

  #added(report) {
    this.reports.push(JSON.parse(textFrom(report)));
    return { positions: this.frame(this.length - 1), ...this.reports.at(-1) };
  }
}

// ---- skeletons ----

/** A skeleton and a clip that moves it, of a file or of a transfer. */
export class Motion extends Handle {
  constructor(pointer, files = null) {
    super(pointer, 'release_motion');
    this.files_ = files;  // of the character: the clip goes into its own
    Object.assign(this, infoOf('motion', pointer));
  }

  /** Reads GLB, glTF, VRM or BVH, with or without a mesh. `clip`: its number; null: none; without: the first that lasts, if there is one. */
  static async read(bytes, name, { clip, others = {}, boneMap = '' } = {}) {
    await load();
    const own = fileName(name);
    const files = Object.entries(others).map(([other, content]) => [other.replace(/^\.?\//, ''), asBytes(content, other)]);
    files.push([own, asBytes(bytes, own)]);
    return new Motion(inFolder(files, () => lent([own, boneMap], (path, map) =>
      call('read_motion', path, path, clip === undefined ? -2 : clip ?? -1, map))), { own, files });
  }

  /** Times of the clip's frames, in seconds. */
  frameTimes(fps = this.fps) { return JSON.parse(textFrom(call('motion_times', this.pointer_, fps))); }

  /** [3 J] places of the joints, in metres; seconds null: at rest. */
  jointsAt(seconds) { return this.#filled('motion_joints', seconds, 3 * this.joints.length); }
  /** [3 V] of its character's mesh; seconds null: as its file has it. */
  positionsAt(seconds) { return this.#filled('motion_positions', seconds, 3 * this.vertexCount); }
  get triangles() {
    return new Uint32Array(memory_.buffer, module_._web_motion_triangles(this.pointer_), 3 * this.triangleCount).slice();
  }

  /** The bytes of a file: the character's own with the clip in it, all else kept; or BVH at a rate. `apply`: the first pose as the rest. */
  write(format, { fps = 0, apply = false } = {}) {
    const formats = this.ownJoints ? ['glb', 'vrm', 'gltf', 'bvh'] : this.files_ ? ['bvh'] : ['glb', 'bvh'];
    if (!formats.includes(format)) throw bad(`format '${format}': ${this.name} is written as ${formats.join(', ')}`);
    const { own, files } = this.files_ ?? { own: '', files: [] };
    const file = `npt-result.${format}`;
    return inFolder(files, () => {
      lent([own, file], (from, to) => call('write_motion', this.pointer_, from, to, fps, apply ? 1 : 0));
      return module_.FS.readFile(file);
    });
  }

  #filled(name, seconds, count) {
    return lent([new Float32Array(count)], (xyz) => {
      call(name, this.pointer_, seconds ?? -1, xyz);
      return floatsAt(xyz, count);
    });
  }
}

/** The source's clip on the joints of a character: a Motion of its file, or a Character, whose estimated body has a skeleton. */
export function transferMotion(character, source, options = {}) {
  const { clipName = '', time = null, fps = 0, footLock = true, clearance = 1, inPlace = false, rootMotion = 'keep' } = options;
  if (!['keep', 'extract'].includes(rootMotion)) throw bad(`rootMotion '${rootMotion}': keep or extract`);
  if (!(clearance >= 0 && clearance <= 1)) throw bad(`clearance ${clearance}: 0 to 1`);
  const own = character instanceof Character ? new Motion(call('character_motion', character.pointer_, character.mesh.pointer_)) : character;
  try {
    return new Motion(lent([clipName], (name) => call('transfer_motion', own.pointer_, source.pointer_, name, time ?? -1, fps, footLock ? 1 : 0,
      clearance, inPlace ? 1 : 0, rootMotion === 'extract' ? 1 : 0)), own.files_);
  } finally {
    if (own !== character) own.close();
  }
}

// f(mesh) on a mesh, or on arrays for as long as f runs.
function borrowed(mesh, name, f) {
  if (mesh instanceof Mesh) return f(mesh);
  const own = made({ name, ...mesh });
  try {
    return f(own);
  } finally {
    own.close();
  }
}

const methods = ['automatic', 'body', 'network'], qualities = ['fast', 'balanced', 'best'];

/** Weights, ready to put poses onto meshes. */
export class PoseTransfer extends Handle {
  constructor(pointer, threads) {
    super(pointer, 'close');
    this.threads = threads;
    Object.assign(this, JSON.parse(textFrom(call('describe', pointer))));
  }

  /** Opens weights (.safetensors). People's hold body estimation, too, or name the file that does, which `others` has then. `further` weights know
   * other kinds of bodies: a mesh that isn't surely of the first is looked at by them. */
  static async open(weights, options = {}) {
    const {
      others = {}, further = {}, name = 'weights', method = 'automatic', quality = 'balanced', figure = 0, pairings = 1, mirror = false,
      refine = false, refineRadius = 0, invariant = false, resample = true, unit = 0, seed = 0, threads: wanted = 0, wasm,
    } = options;
    if (!methods.includes(method)) throw bad(`method '${method}': automatic, body or network`);
    if (!qualities.includes(quality)) throw bad(`quality '${quality}': fast, balanced or best`);
    if (!Number.isInteger(figure) || figure < 0) throw bad(`figure ${figure}: a whole number, 1 for the one with the most vertices`);
    await load({ wasm });
    const count = wanted > 0 ? Math.min(wanted, threads()) : threads();
    const own = fileName(name);
    const files = Object.entries(others).map(([other, content]) => [fileName(other), asBytes(content, other)]);
    files.push([own, asBytes(weights, own)]);
    const more = Object.entries(further).map(([other, content]) => [fileName(other), asBytes(content, other)]);
    const pointer = inFolder([...files, ...more], () => lent([own, more.map(([file]) => file).join('\n')], (path, paths) =>
      call('open', path, paths, methods.indexOf(method), qualities.indexOf(quality), figure, pairings, mirror ? 1 : 0, refine ? 1 : 0, refineRadius,
        invariant ? 1 : 0, resample ? 1 : 0, unit, seed, count)));
    taken += 2 * (count - 1);
    return new PoseTransfer(pointer, count);
  }

  /** Estimates a body for an identity and binds it, once for many poses. */
  character(mesh) {
    if (mesh instanceof Mesh) return new Character(this, mesh);
    const own = made({ name: 'identity', ...mesh });
    try {
      return new Character(this, own);
    } finally {
      own.close();  // the character keeps it
    }
  }
  /** A character that was saved. Its mesh has triangles alone; `mesh`: the one that it was made of, with all that its file holds. */
  loadCharacter(bytes, { mesh = null, name = 'character' } = {}) {
    const file = fileName(name);
    const pointer = inFolder([[file, asBytes(bytes, file)]], () => lent([file], (path) => call('load_character', this.pointer_, path)));
    let own = null;
    try {
      own = new Mesh(call('character_mesh', pointer));
      if (mesh !== null && mesh.vertexCount !== own.vertexCount)
        throw bad(`mesh: ${mesh.vertexCount} vertices, expected ${own.vertexCount}, the character's`);
      return new Character(this, mesh ?? own, pointer);
    } catch (error) {
      module_._web_release_character(pointer);
      throw error;
    } finally {
      own?.close();
    }
  }
  /** Estimates the pose of a mesh, once for many characters of so many vertices. */
  pose(mesh, characterVertices) {
    return borrowed(mesh, 'pose', (own) => new Pose(this, call('pose', this.pointer_, own.pointer_, characterVertices)));
  }
  /** For the poses of a sequence. */
  tracker() { return new PoseTracker(this); }
  /** For a sequence on a character, frame by frame. */
  animation(character) {
    if (character instanceof Character) return new Animation(character);
    const own = this.character(character);
    try {
      return new Animation(own);
    } finally {
      own.close();
    }
  }
  /** A whole sequence on a character. `rest`: its rig at rest; `progress(share)`: called before each frame. */
  animate(character, frames, { followRoot = true, rest = null, progress = null } = {}) {
    if (frames.length === 0) throw bad('frames: none');
    const animation = this.animation(character);
    try {
      frames.forEach((frame, i) => {
        progress?.(i / frames.length);
        if (i > 0) animation.add(frame);
        else animation.start(frame, [...(rest === null ? [] : [rest]), ...framesToTry(frames.length).map((k) => frames[k])]);
      });
      return animation.finish({ followRoot });
    } catch (error) {
      animation.close();
      throw error;
    }
  }

  /** The character in the pose. Both may be meshes or arrays, too. */
  apply(character, pose) {
    const own = [];
    try {
      let usedCharacter = character, usedPose = pose;
      if (!(character instanceof Character)) own.push(usedCharacter = this.character(character));
      if (!(pose instanceof Pose)) own.push(usedPose = this.pose(pose, usedCharacter.mesh.vertexCount));
      if (usedCharacter.transfer !== this || usedPose.transfer !== this) throw bad('prepared by another transfer');
      const report = JSON.parse(textFrom(call('report', usedCharacter.pointer_, usedPose.pointer_)));
      const count = 3 * usedCharacter.mesh.vertexCount;
      const positions = lent([new Float32Array(count)], (xyz) => {
        try {
          call('apply', usedCharacter.pointer_, usedPose.pointer_, xyz);
        } catch (error) {
          error.report = report;  // why the network was asked at all
          throw error;
        }
        return floatsAt(xyz, count);
      });
      return { positions, ...report };
    } finally {
      for (const handle of own) handle.close();
    }
  }

  /** Metres in a unit of the mesh, inferred from its size; 0 where that is no person's. */
  unitOf(mesh) { return module_._web_unit(this.pointer_, mesh.pointer_); }
}
