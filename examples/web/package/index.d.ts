/** npt in WebAssembly: the pose of one mesh onto another. Everything but loading is computed at once, in the calling thread: call it in
 * a worker. Handles hold memory of the module until close(); what was made of a closed handle goes on to work. */

/** What can't be done. The message is the library's: it names the file or argument, what was found and what was expected. */
export class NptError extends Error {
  readonly kind: 'argument' | 'input' | 'memory' | 'internal';
  /** What kind of fault it is, for programs that act on it. */
  readonly code: 'bad_input' | 'not_recognised' | 'unknown_unit' | 'missing_weights' | 'foreign' | 'domains_differ' |
    'needs_recognition' | 'stopped';
  /** What can be done about it. */
  readonly remedy: Remedy;
  /** Where a transfer was refused: what is known of the meshes. */
  readonly report?: Report;
}

/** What a user can do; a page says it in its own words. */
export type Remedy = 'none' | 'look_at_result' | 'choose_method' | 'give_unit' | 'give_weights';

export type Bytes = ArrayBuffer | ArrayBufferView;

/** Loads the module, once; every other call does so by itself. `wasm`: where npt-single.wasm is, its bytes or its module. `threads`: at most so many,
 * and at most four; where the page isn't cross-origin isolated, and outside workers, there is one. */
export function load(options?: { wasm?: string | URL | Bytes | WebAssembly.Module; threads?: number }): Promise<void>;
/** Threads that a transfer would be opened with now. */
export function threads(): number;
export function version(): Promise<string>;
/** Bytes of memory that the module holds. */
export function memory(): number;

export interface MeshArrays {
  /** [3 V] x0 y0 z0 x1 y1 z1 ... */
  positions: Float32Array | ArrayLike<number>;
  /** [3 T] vertex numbers. Without them the mesh is a cloud of points, which only the network takes. */
  triangles?: Uint32Array | ArrayLike<number> | null;
  /** Stands in messages. */
  name?: string;
}

export interface Clip {
  readonly name: string;
  /** Seconds. */
  readonly length: number;
}

declare abstract class Handle {
  readonly closed: boolean;
  close(): void;
}

/** A mesh with all that its file holds. */
export class Mesh extends Handle {
  private constructor();
  /** OBJ, PLY, GLB, glTF and OFF, by the extension of `name`. `others`: files that it names, by their names in it. */
  static read(bytes: Bytes, name: string, others?: Record<string, Bytes>): Promise<Mesh>;
  static from(mesh: MeshArrays): Promise<Mesh>;
  /** The built-in mannequin, as `npt generate` makes it. `angles`: [72] axis angles of its joints instead of a pose. */
  static mannequin(options?: {
    shapeSeed?: number; proportions?: boolean; pose?: 'rest' | 'random' | 'wide' | 'natural'; poseSeed?: number;
    angles?: ArrayLike<number> | null; name?: string;
  }): Promise<Mesh>;
  readonly name: string;
  readonly vertexCount: number;
  readonly faceCount: number;
  readonly triangleCount: number;
  readonly clips: readonly Clip[];
  /** [3 V], a copy. */
  readonly positions: Float32Array;
  /** [3 T], a copy. */
  readonly triangles: Uint32Array;
  /** Moves the mesh to a time of a clip; null: as its file has it at rest. */
  moveTo(clip: number | null, seconds?: number): void;
  /** Seconds of a clip's frames at a rate. */
  frameTimes(clip: number, fps?: number): number[];
  /** A file of this mesh: faces, UVs, groups and materials as far as the format has them. `transfer` knows its unit: GLB is in metres. */
  write(format: 'obj' | 'ply' | 'glb', options?: { positions?: ArrayLike<number> | null; transfer?: PoseTransfer | null }): Uint8Array;
}

/** What a user should know. `text` is plain English that names the mesh; `value`: a confidence, or metres in one unit (unit_assumed). */
export interface Warning {
  readonly code: 'not_recognised' | 'low_confidence' | 'no_surface' | 'upside_down' | 'lying' | 'lying_or_z_up' | 'arms_uncertain' |
    'legs_uncertain' | 'unusual_proportions' | 'faces_inward' | 'unit_assumed' | 'part_of_mesh';
  readonly mesh: 'identity' | 'pose';
  readonly value: number;
  readonly text: string;
  readonly remedy: Remedy;
}

/** How a result was made. */
export interface Report {
  readonly method: 'body' | 'network';
  /** Whose body made it: "person" or "four-legged animal"; "": the network. */
  readonly kind: string;
  /** The lower of both meshes', 0 to 1: that they are of the kind, and that their poses were estimated rightly. From 0.85 on all is well; what is
   * below 0.6 is refused. null: no body was estimated. */
  readonly confidence: number | null;
  readonly warnings: readonly Warning[];
}

export interface Result extends Report {
  /** [3 V] in the identity's order, unit and place. */
  readonly positions: Float32Array;
}

export interface TransferOptions {
  /** Files that the weights name, by their names: human-pooled names human.safetensors, which holds body estimation. */
  others?: Record<string, Bytes>;
  /** More weights, by names for messages: quadruped.safetensors, so that four-legged animals are recognised, too. They cost nothing until a mesh
   * isn't surely of the first weights' kind. */
  further?: Record<string, Bytes>;
  /** Of the weights, for messages. */
  name?: string;
  /** automatic: by body estimation, which refuses what it doesn't recognise; by the network where the weights hold none. */
  method?: 'automatic' | 'body' | 'network';
  /** Of body estimation; fast takes about half of the time. */
  quality?: 'fast' | 'balanced' | 'best';
  /** Of several figures in one mesh this one, from 1 on, the one with the most vertices first; a mesh of one figure is taken whole. 0: the one that
   * is recognised. */
  figure?: number;
  pairings?: number;
  mirror?: boolean;
  refine?: boolean;
  refineRadius?: number;
  invariant?: boolean;
  resample?: boolean;
  /** Metres in a unit of the meshes; 0: inferred from their size. */
  unit?: number;
  seed?: number;
  /** 0: as many as there are. */
  threads?: number;
  wasm?: string | URL | Bytes | WebAssembly.Module;
}

interface Estimated extends Handle {
  readonly transfer: PoseTransfer;
  /** Whether its confidence is high enough for body estimation. */
  readonly recognised: boolean;
  /** 0 to 1; null: no body was estimated. */
  readonly confidence: number | null;
  /** Of the weights: "human". */
  readonly domain: string;
  /** What it is recognised as: "person", "four-legged animal"; "": as nothing. */
  readonly kind: string;
  readonly warnings: readonly Warning[];
}

/** An identity that takes many poses. */
export interface Character extends Estimated {
  readonly mesh: Mesh;
  /** A file from which `loadCharacter` makes it again. It has to be recognised. */
  save(): Uint8Array;
}

/** A pose that many characters take. */
export interface Pose extends Estimated {}

/** The poses of a sequence: choices are made once, each frame is followed from the last one. A mesh with other faces begins another sequence. */
export interface PoseTracker extends Handle {
  next(frame: Mesh | MeshArrays, characterVertices: number): Pose;
}

/** Frames of a sequence beside the first that are worth a try for its start. */
export function framesToTry(count: number): number[];

/** A sequence on one character. */
export interface Animation extends Handle {
  readonly character: Character;
  readonly length: number;
  readonly reports: readonly Report[];
  /** Of the frame with the lowest confidence. */
  readonly report: Report;
  readonly weakest: number;
  readonly finished: boolean;
  /** The first frame; followed from the best of it and of `others` with the same triangles. */
  start(first: Mesh | MeshArrays, others?: readonly (Mesh | MeshArrays)[]): Result;
  add(frame: Mesh | MeshArrays): Result;
  /** `followRoot`: along the poses' root trajectory, in proportion to the character's legs. */
  finish(options?: { followRoot?: boolean }): this;
  frame(i: number): Float32Array;
  /** A GLB that moves. */
  write(options?: { clip?: string; fps?: number; times?: ArrayLike<number> | null }): Uint8Array;
}

export interface Joint {
  readonly name: string;
  /** Its number; -1: none. */
  readonly parent: number;
  /** Which part of a body it moves: "hips", "leftUpperLeg"; null: none. */
  readonly role: string | null;
  /** It only marks where its parent ends. */
  readonly end: boolean;
}

/** What a user should know of a clip on another skeleton. */
export interface MotionWarning {
  readonly code: 'joints_uncertain' | 'joints_missing';
  readonly skeleton: 'character' | 'source';
  readonly text: string;
}

/** A skeleton and a clip that moves it, of a file or of a transfer. */
export class Motion extends Handle {
  private constructor();
  /** GLB, glTF, VRM and BVH, with or without a mesh. `clip`: its number; null: none; without: the first that lasts, if there is one. `boneMap`: which joint
   * is which, as text. */
  static read(bytes: Bytes, name: string, options?: { clip?: number | null; others?: Record<string, Bytes>; boneMap?: string }): Promise<Motion>;
  readonly name: string;
  /** The clip's name. */
  readonly clip: string;
  /** Seconds. */
  readonly length: number;
  /** Frames a second of the clip's keys; 30 where these lie on no frames. */
  readonly fps: number;
  /** That it is a person's skeleton, 0 to 1; of a transfer, the lower of both. */
  readonly confidence: number;
  readonly joints: readonly Joint[];
  /** Of its file. */
  readonly clips: readonly Clip[];
  readonly warnings: readonly MotionWarning[];
  /** Its joints are those of a GLB, glTF or VRM file. */
  readonly ownJoints: boolean;
  /** Of its character's mesh; 0: none. */
  readonly vertexCount: number;
  readonly triangleCount: number;
  /** [3 T], a copy. */
  readonly triangles: Uint32Array;
  frameTimes(fps?: number): number[];
  /** [3 J] places of the joints, in metres; null: at rest. */
  jointsAt(seconds: number | null): Float32Array;
  /** [3 V]; null: as its file has it. */
  positionsAt(seconds: number | null): Float32Array;
  /** The character's own file with the clip in it, all else kept; or BVH at `fps`. `apply`: the first pose as the rest of its joints. */
  write(format: 'glb' | 'vrm' | 'gltf' | 'bvh', options?: { fps?: number; apply?: boolean }): Uint8Array;
}

export interface MotionOptions {
  /** Of the result; without: as the source's. */
  clipName?: string;
  /** The pose at this second alone. */
  time?: number | null;
  /** Keys at so many frames a second; 0: as the source has them. */
  fps?: number;
  /** Feet that stand are held. */
  footLock?: boolean;
  /** How far arms and thighs are kept out of the body: 0 to 1. */
  clearance?: number;
  /** The way over the ground is left out. */
  inPlace?: boolean;
  /** extract: the way over the ground on the topmost joint. */
  rootMotion?: 'keep' | 'extract';
}

/** The source's clip on a character's joints: those of its file, or those that its estimated body gives it. Needs no weights for the former. */
export function transferMotion(character: Motion | Character, source: Motion, options?: MotionOptions): Motion;

export class PoseTransfer extends Handle {
  private constructor();
  static open(weights: Bytes, options?: TransferOptions): Promise<PoseTransfer>;
  /** "bottleneck 256, conv_relu, per-vertex, people by body estimation". */
  readonly description: string;
  readonly pairsVertices: boolean;
  readonly hasBody: boolean;
  /** From this confidence on a mesh is surely of its kind: 0.85. */
  readonly highConfidence: number;
  readonly threads: number;
  apply(character: Mesh | MeshArrays | Character, pose: Mesh | MeshArrays | Pose): Result;
  character(mesh: Mesh | MeshArrays): Character;
  /** `mesh`: the one that it was made of; without, the character's has triangles alone. */
  loadCharacter(bytes: Bytes, options?: { mesh?: Mesh | null; name?: string }): Character;
  /** `characterVertices`: of the characters that take it. */
  pose(mesh: Mesh | MeshArrays, characterVertices: number): Pose;
  tracker(): PoseTracker;
  /** A sequence, frame by frame. */
  animation(character: Mesh | MeshArrays | Character): Animation;
  /** A whole sequence. `rest`: the frames' rig at rest, which may be what it is best followed from. */
  animate(character: Mesh | MeshArrays | Character, frames: readonly (Mesh | MeshArrays)[], options?: {
    followRoot?: boolean; rest?: Mesh | MeshArrays | null; progress?: ((share: number) => void) | null;
  }): Animation;
  unitOf(mesh: Mesh): number;
}
