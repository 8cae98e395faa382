// usage: node halve.mjs IN OUT: weights (.safetensors) with their 32-bit numbers rounded to 16 bits, which halves them on the wire.
// Binary16 (F16) where all numbers have their place in it, which is 8 times as fine as bfloat16 (BF16); else that.
import { readFileSync, writeFileSync } from 'node:fs';

const [input, output] = process.argv.slice(2);
const bytes = readFileSync(input);
const length = Number(bytes.readBigUInt64LE(0));
const header = JSON.parse(bytes.toString('utf8', 8, 8 + length));

const number = new Float32Array(1), bits = new Uint32Array(number.buffer);
const largest = 65504, smallest = 2 ** -24;  // of binary16

// x / unit to the nearest whole number, ties to even.
function nearest(x, unit) {
  const steps = x / unit, low = Math.floor(steps), rest = steps - low;
  return rest > 0.5 || (rest === 0.5 && low % 2 === 1) ? low + 1 : low;
}
function binary16(x) {
  const sign = x < 0 || Object.is(x, -0) ? 0x8000 : 0, size = Math.abs(x);
  const exponent = Math.max(-14, Math.floor(Math.log2(size || smallest)));
  const steps = nearest(size, 2 ** (exponent - 10));  // 1024 to 2048, or fewer below 2^-14
  // A carry into the next power of two is right as it stands, and so are subnormal numbers.
  return sign | (steps + (exponent + 14) * 1024);
}
function bfloat16(x) {
  number[0] = x;
  return ((bits[0] + 0x7fff + ((bits[0] >>> 16) & 1)) / 65536) & 0xffff;
}

const parts = [];
let at = 0;
const tensors = Object.entries(header).filter(([name]) => name !== '__metadata__');
for (const [, tensor] of tensors.sort(([, a], [, b]) => a.data_offsets[0] - b.data_offsets[0])) {
  const [first, last] = tensor.data_offsets;
  let content = bytes.subarray(8 + length + first, 8 + length + last);
  // Single numbers, such as a scale, cost nothing.
  if (tensor.dtype === 'F32' && content.length > 64) {
    const numbers = Array.from({ length: content.length / 4 }, (_, i) => content.readFloatLE(4 * i));
    const fits = numbers.every((x) => Math.abs(x) <= largest);
    const halves = Buffer.alloc(content.length / 2);
    numbers.forEach((x, i) => halves.writeUInt16LE(fits ? binary16(x) : bfloat16(x), 2 * i));
    content = halves;
    tensor.dtype = fits ? 'F16' : 'BF16';
  }
  tensor.data_offsets = [at, at += content.length];
  parts.push(content);
}
let text = JSON.stringify(header);
text += ' '.repeat((8 - Buffer.byteLength(text) % 8) % 8);
const size = Buffer.alloc(8);
size.writeBigUInt64LE(BigInt(Buffer.byteLength(text)));
writeFileSync(output, Buffer.concat([size, Buffer.from(text), ...parts]));
