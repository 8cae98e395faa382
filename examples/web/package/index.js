// npt in WebAssembly: typed arrays in and out. index.d.ts says what each part takes and gives.
const kinds = ['none', 'argument', 'input', 'memory', 'internal'];

/** What can't be done: the library's message, and whether it is the caller's, the input's or the memory's doing. */
export class NptError extends Error {
  constructor(message, kind, options) {
    super(message, options);
    this.name = 'NptError';
    this.kind = kind;
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

// Each transfer has threads for its network and as many for its reader; there are those for two. They are started with the module, since
// a thread that waits for another can't start it.
const poolOf = (threads) => 4 * (threads - 1);
let taken = 0;  // of the pool, by transfers that are open

/** Threads of a transfer that is opened now: 1 where memory can't be shared, or others have taken them. */
export const threads = () => (taken + 2 * (threads_ - 1) <= poolOf(threads_) ? threads_ : 1);

const bytes_ = () => new Uint8Array(memory_.buffer);

/** The version of npt: "0.1.0". */
export async function version() {
  await load();
  return module_.UTF8ToString(module_._web_version());
}

/** Bytes of memory that the module holds. It grows as needed, to 2 GB at most, and never shrinks. */
export const memory = () => (memory_ ? memory_.buffer.byteLength : 0);

function failure() {
  return new NptError(module_.UTF8ToString(module_._web_error()), kinds[module_._web_error_kind()] ?? 'internal');
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

  /** Moves the mesh to a time, in seconds, of one of its clips. */
  moveTo(clip, time) {
    if (!this.clips[clip]) throw bad(`clip ${clip}: ${this.name} has ${this.clips.length}`);
    call('move', this.pointer_, clip, time);
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

/** An identity that takes many poses. */
class PreparedIdentity extends Handle {
  constructor(transfer, mesh) {
    super(call('prepare_identity', transfer.pointer_, mesh.pointer_), 'release_identity', [transfer, mesh]);
    this.transfer = transfer;
    this.mesh = mesh;
  }
}

/** A pose that many identities take. */
class PreparedPose extends Handle {
  constructor(transfer, mesh, vertices) {
    super(call('prepare_pose', transfer.pointer_, mesh.pointer_, vertices), 'release_pose', [transfer]);
    this.transfer = transfer;
  }
}

/** Frames of one movement on one identity, one after another. */
class Sequence extends Handle {
  constructor(identity) {
    super(call('open_sequence', identity.pointer_), 'close_sequence', [identity]);
    this.identity = identity;
    this.length = 0;
    this.reports = [];
  }

  /** Transfers the next frame. */
  add(pose) {
    return borrowed(pose, 'pose', (mesh) => {
      const report = JSON.parse(textFrom(call('add_frame', this.pointer_, mesh.pointer_)));
      this.reports.push(report);
      this.length += 1;
      return { positions: this.frame(this.length - 1), report };
    });
  }

  /** Takes the frames along the pose's way, as `npt transfer --clip` does. After the last frame. */
  followRoot() { call('follow_root', this.pointer_); }

  /** Positions [3 V] of frame i. */
  frame(i) { return floatsAt(call('frame', this.pointer_, i), 3 * this.identity.mesh.vertexCount); }

  /** A GLB that moves. */
  write({ clip = 'clip', fps = 30, times = null } = {}) {
    const seconds = Float64Array.from(times ?? Array.from({ length: this.length }, (_, i) => i / fps));
    if (seconds.length !== this.length) throw bad(`times: ${seconds.length}, expected ${this.length}`);
    return inFolder([], () => {
      lent(['result.glb', clip, seconds], (path, name, at) => call('write_sequence', this.pointer_, path, name, at));
      return module_.FS.readFile('result.glb');
    });
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

const methods = ['automatic', 'body', 'network'];

/** Weights, ready to put poses onto meshes. */
export class PoseTransfer extends Handle {
  constructor(pointer, threads) {
    super(pointer, 'close');
    this.threads = threads;
    Object.assign(this, JSON.parse(textFrom(call('describe', pointer))));
  }

  /** Opens weights (.safetensors). Without `reader`, the network that reads people, all transfers are the network's. */
  static async open(weights, options = {}) {
    const {
      reader = null, name = 'weights', method = 'automatic', pairings = 1, mirror = false, refine = false, refineRadius = 0,
      invariant = false, resample = true, unit = 0, seed = 0, threads: wanted = 0, wasm,
    } = options;
    if (!methods.includes(method)) throw bad(`method '${method}': automatic, body or network`);
    await load({ wasm });
    const count = wanted > 0 ? Math.min(wanted, threads()) : threads();
    const own = fileName(name);
    const files = [[own, asBytes(weights, own)]];
    if (reader !== null) files.push(['reader.safetensors', asBytes(reader, 'reader')]);
    const pointer = inFolder(files, () => lent([own, reader === null ? '' : 'reader.safetensors'], (path, readerPath) =>
      call('open', path, readerPath, methods.indexOf(method), pairings, mirror ? 1 : 0, refine ? 1 : 0, refineRadius, invariant ? 1 : 0,
        resample ? 1 : 0, unit, seed, count)));
    taken += 2 * (count - 1);
    return new PoseTransfer(pointer, count);
  }

  prepareIdentity(mesh) {
    if (mesh instanceof Mesh) return new PreparedIdentity(this, mesh);
    const own = made({ name: 'identity', ...mesh });
    try {
      return new PreparedIdentity(this, own);
    } finally {
      own.close();  // the prepared identity keeps it
    }
  }
  preparePose(mesh, identityVertices) {
    return borrowed(mesh, 'pose', (own) => new PreparedPose(this, own, identityVertices));
  }
  openSequence(identity) {
    if (identity instanceof PreparedIdentity) return new Sequence(identity);
    const own = this.prepareIdentity(identity);
    try {
      return new Sequence(own);
    } finally {
      own.close();
    }
  }

  /** The identity's positions in the pose. Both may be meshes, arrays, or prepared. */
  run(identity, pose) {
    const own = [];
    try {
      let preparedIdentity = identity, preparedPose = pose;
      if (!(identity instanceof PreparedIdentity)) own.push(preparedIdentity = this.prepareIdentity(identity));
      if (!(pose instanceof PreparedPose))
        own.push(preparedPose = this.preparePose(pose, preparedIdentity.mesh.vertexCount));
      if (preparedIdentity.transfer !== this || preparedPose.transfer !== this)
        throw bad('prepared by another transfer');
      const report = JSON.parse(textFrom(call('report', preparedIdentity.pointer_, preparedPose.pointer_)));
      const count = 3 * preparedIdentity.mesh.vertexCount;
      const positions = lent([new Float32Array(count)], (xyz) => {
        try {
          call('run', preparedIdentity.pointer_, preparedPose.pointer_, xyz);
        } catch (error) {
          error.report = report;  // why the network was asked at all
          throw error;
        }
        return floatsAt(xyz, count);
      });
      return { positions, report };
    } finally {
      for (const handle of own) handle.close();
    }
  }

  /** Metres in a unit of the mesh, told from its size; 0 where that is no person's. */
  unitOf(mesh) { return module_._web_unit(this.pointer_, mesh.pointer_); }
}
