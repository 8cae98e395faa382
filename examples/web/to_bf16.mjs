// usage: node to_bf16.mjs IN OUT: weights (.safetensors) with their 32-bit numbers rounded to bfloat16, which halves them on the wire.
import { readFileSync, writeFileSync } from 'node:fs';

const [input, output] = process.argv.slice(2);
const bytes = readFileSync(input);
const length = Number(bytes.readBigUInt64LE(0));
const header = JSON.parse(bytes.toString('utf8', 8, 8 + length));
const parts = [];
let at = 0;
for (const [name, tensor] of Object.entries(header).sort(([, a], [, b]) => (a.data_offsets?.[0] ?? 0) - (b.data_offsets?.[0] ?? 0))) {
  if (name === '__metadata__') continue;
  const [first, last] = tensor.data_offsets;
  let content = bytes.subarray(8 + length + first, 8 + length + last);
  // Single numbers, such as a scale, cost nothing.
  if (tensor.dtype === 'F32' && content.length > 64) {
    const halves = Buffer.alloc(content.length / 2);
    for (let i = 0; i < halves.length; i += 2) {
      const bits = content.readUInt32LE(2 * i);
      halves.writeUInt16LE(((bits + 0x7fff + ((bits >>> 16) & 1)) / 65536) & 0xffff, i);  // to nearest, ties to even
    }
    content = halves;
    tensor.dtype = 'BF16';
  }
  tensor.data_offsets = [at, at += content.length];
  parts.push(content);
}
let text = JSON.stringify(header);
text += ' '.repeat((8 - Buffer.byteLength(text) % 8) % 8);
const size = Buffer.alloc(8);
size.writeBigUInt64LE(BigInt(Buffer.byteLength(text)));
writeFileSync(output, Buffer.concat([size, Buffer.from(text), ...parts]));
