// The package's first steps, as its README shows them, on two meshes of its own: run in the folder where it is installed.
import { readFileSync } from 'node:fs';
import { Mesh, PoseTransfer, version } from 'npt-web';

console.log(`npt ${await version()}`);
const weights = readFileSync('node_modules/npt-web/weights/human.safetensors');
const transfer = await PoseTransfer.open(weights);
const identity = await Mesh.mannequin({ shapeSeed: 3, pose: 'rest' }), pose = await Mesh.mannequin({ shapeSeed: 8, pose: 'natural', poseSeed: 8 });
const { positions, method, kind, confidence } = transfer.apply(identity, pose);
if (positions.length !== 3 * identity.vertexCount || !positions.every(Number.isFinite)) throw new Error(`found ${positions.length} coordinates`);
console.log(`by ${method}, ${kind}, confidence ${confidence.toFixed(2)}`);
