// Meshes side by side, for the tests of the web package.
import { readFileSync } from 'node:fs';
import path from 'node:path';

export const read = (Mesh, file) => Mesh.read(readFileSync(file), path.basename(file));

// The largest difference of a coordinate, as a share of the height of `a`.
export function difference(a, b) {
  if (a.length !== b.length) return Infinity;
  let low = Infinity, high = -Infinity, most = 0;
  for (let i = 0; i < a.length; ++i) {
    if (i % 3 === 1) low = Math.min(low, a[i]), high = Math.max(high, a[i]);
    const d = Math.abs(a[i] - b[i]);
    most = d <= most ? most : d;  // NaN stays
  }
  return most / (high - low);
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
    console.log(`${what}: largest difference ${share.toExponential(1)} of the mesh's height`);
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
