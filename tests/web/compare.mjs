// Meshes side by side, for the tests of the web package.
import { readFileSync } from 'node:fs';
import path from 'node:path';

export const read = (Mesh, file) => Mesh.read(readFileSync(file), path.basename(file));

// The largest difference of a coordinate, as a share of the largest side of `a`: of who lies, the height says little.
export function difference(a, b) {
  if (a.length !== b.length) return Infinity;
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  let most = 0;
  for (let i = 0; i < a.length; ++i) {
    low[i % 3] = Math.min(low[i % 3], a[i]), high[i % 3] = Math.max(high[i % 3], a[i]);
    const d = Math.abs(a[i] - b[i]);
    most = d <= most ? most : d;  // NaN stays
  }
  return most / Math.max(...low.map((x, k) => high[k] - x));
}

// The tensors and texts of a safetensors file whose names begin with `prefix`, without it, as a file.
export function partOf(bytes, prefix) {
  const length = Number(bytes.readBigUInt64LE(0)), header = JSON.parse(bytes.toString('utf8', 8, 8 + length));
  const cut = (entries) => Object.entries(entries).filter(([name]) => name.startsWith(prefix)).map(([name, value]) => [name.slice(prefix.length), value]);
  const part = { __metadata__: Object.fromEntries(cut(header.__metadata__)) }, contents = [];
  let at = 0;
  for (const [name, tensor] of cut(header)) {
    const [first, last] = tensor.data_offsets;
    contents.push(bytes.subarray(8 + length + first, 8 + length + last));
    part[name] = { ...tensor, data_offsets: [at, at += last - first] };
  }
  const text = Buffer.from(JSON.stringify(part)), size = Buffer.alloc(8);
  size.writeBigUInt64LE(BigInt(text.length));
  return Buffer.concat([size, text, ...contents]);
}

export class Checks {
  failures = 0;
  expect(good, what) {
    if (good) return;
    this.failures += 1;
    console.log(`FAILED: ${what}`);
  }
  near(a, b, what, bound = 1e-5) {
    const share = difference(a, b);
    console.log(`${what}: largest difference ${share.toExponential(1)} of the mesh's size`);
    this.expect(share <= bound, `${what}: ${share}, expected at most ${bound}`);
  }
  async fails(f, kind, pattern, what) {
    try {
      await f();
    } catch (error) {
      this.expect(error.kind === kind && pattern.test(error.message), `${what}: ${error.kind}: ${error.message}, expected ${kind}: ${pattern}`);
      return;
    }
    this.expect(false, `${what}: no error`);
  }
  end() {
    console.log(this.failures === 0 ? 'all as expected' : `${this.failures} failures`);
    process.exit(this.failures === 0 ? 0 : 1);
  }
}
