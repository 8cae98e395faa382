/** npt in WebAssembly: the pose of one mesh onto another. Everything but loading is computed at once, in the calling thread: call it in
 * a worker. Handles hold memory of the module until close(); what was made of a closed handle goes on to work. */

/** What can't be done. The message is the library's: it names the file or argument, what was found and what was expected. */
export class NptError extends Error {
  readonly kind: 'argument' | 'input' | 'memory' | 'internal';
  /** Where a transfer was refused: how the meshes were read. */
  readonly report?: Report;
}

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
  /** Moves the mesh to a time of a clip. */
  moveTo(clip: number, seconds: number): void;
  /** A file of this mesh: faces, UVs, groups and materials as far as the format has them. `transfer` knows its unit: GLB is in metres. */
  write(format: 'obj' | 'ply' | 'glb', options?: { positions?: ArrayLike<number> | null; transfer?: PoseTransfer | null }): Uint8Array;
}

/** How a result was made. */
export interface Report {
  readonly method: 'body' | 'network';
  /** Whether both were read as people; trusts and notes are of this reading. From 0.85 on all is well; below 0.6 the network is asked. */
  readonly read: boolean;
  readonly identityTrust: number;
  readonly poseTrust: number;
  readonly identityNotes: string;
  readonly poseNotes: string;
}

export interface Result {
  /** [3 V] in the identity's order, unit and place. */
  readonly positions: Float32Array;
  readonly report: Report;
}

export interface TransferOptions {
  /** Weights of the network that reads people: people in any pose then go through bodies, as in `npt transfer`. */
  reader?: Bytes | null;
  /** Of the weights, for messages. */
  name?: string;
  method?: 'automatic' | 'body' | 'network';
  pairings?: number;
  mirror?: boolean;
  refine?: boolean;
  refineRadius?: number;
  invariant?: boolean;
  resample?: boolean;
  /** Metres in a unit of the meshes; 0: told from their size. */
  unit?: number;
  seed?: number;
  /** 0: as many as there are. */
  threads?: number;
  wasm?: string | URL | Bytes | WebAssembly.Module;
}

export interface PreparedIdentity extends Handle { readonly mesh: Mesh; readonly transfer: PoseTransfer; }
export interface PreparedPose extends Handle { readonly transfer: PoseTransfer; }

/** Frames of one movement: choices are made once, each frame goes on from the last one. */
export interface Sequence extends Handle {
  readonly length: number;
  readonly reports: readonly Report[];
  add(pose: Mesh | MeshArrays): Result;
  followRoot(): void;
  frame(i: number): Float32Array;
  write(options?: { clip?: string; fps?: number; times?: ArrayLike<number> | null }): Uint8Array;
}

export class PoseTransfer extends Handle {
  private constructor();
  static open(weights: Bytes, options?: TransferOptions): Promise<PoseTransfer>;
  /** "bottleneck 256, conv_relu, per-vertex, people through bodies". */
  readonly description: string;
  readonly pairsVertices: boolean;
  readonly hasBody: boolean;
  readonly threads: number;
  run(identity: Mesh | MeshArrays | PreparedIdentity, pose: Mesh | MeshArrays | PreparedPose): Result;
  prepareIdentity(mesh: Mesh | MeshArrays): PreparedIdentity;
  /** `identityVertices`: of the identities that take it. */
  preparePose(mesh: Mesh | MeshArrays, identityVertices: number): PreparedPose;
  openSequence(identity: Mesh | MeshArrays | PreparedIdentity): Sequence;
  unitOf(mesh: Mesh): number;
}
