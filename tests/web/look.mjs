// usage: node look.mjs NODE_MODULES CHROMIUM WEB PROGRAM FOLDER [IMAGES]
// The page in headless Chromium from a plain static server, as a visitor uses it; what it saves is held against the program's results on the
// same weights. WEB: what build.sh left. Pictures go to FOLDER, those of the docs to IMAGES as well.
import { copyFileSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { drawn, launch, runner, unreached, visit } from '../view/browser.mjs';
import { Checks, partOf, read } from './compare.mjs';
import { bvhWalk } from './motions.mjs';
import { serve } from './server.mjs';

const [modules, chromium, web, program, out, images] = process.argv.slice(2).map((name) => path.resolve(name));
const axe = readFileSync(path.join(modules, 'axe-core/axe.min.js'), 'utf8');
const { Mesh, Motion } = await import(pathToFileURL(path.join(web, 'package/index.js')));
const { bonesMesh } = await import(pathToFileURL(path.join(web, 'page/bones.js')));
const { samples } = await import(pathToFileURL(path.join(web, 'page/samples.js')));
rmSync(out, { recursive: true, force: true });
mkdirSync(path.join(out, 'walk'), { recursive: true });
process.chdir(out);
const run = runner(program);

const checks = new Checks();
const weights = path.join(web, 'page/weights/human.safetensors');
const server = await serve(path.join(web, 'page'));
const browser = await launch(path.join(modules, 'playwright-core'), chromium);

async function open(options = {}, at = server) {
  const start = Date.now();
  const { context, page, complaints } = await visit(browser, at.url, { viewport: { width: 1280, height: 800 }, bypassCSP: false, ...options });
  const until = (f, argument) => page.waitForFunction(f, argument ?? null, { timeout: 240000, polling: 50 });
  await until(() => document.querySelectorAll('#captions p').length === 3);
  const first = (Date.now() - start) / 1000;
  const settled = () => until(() => document.documentElement.dataset.ready === 'yes');
  const text = (id) => page.textContent(`#${id}`);
  // A result, or the message that says why there is none.
  const done = async (what) => {
    await settled();
    checks.expect(await page.locator('#notice').isHidden(), `${what}: ${await text('notice-text')}`);
    checks.expect(await page.locator('#save').isEnabled(), `${what}: nothing to save`);
  };
  const save = async (format) => {
    await page.selectOption('#format', format);
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#save')]);
    const file = `saved-${download.suggestedFilename()}`;
    await download.saveAs(file);
    await settled();
    return file;
  };
  const picture = async (name, image) => {
    await drawn(page);
    await page.screenshot({ path: `${name}.png` });
    if (image && images) {
      await page.screenshot({ path: `${image}.jpg`, type: 'jpeg', quality: 86 });
      copyFileSync(`${image}.jpg`, path.join(images, `${image}.jpg`));
    }
  };
  const accessible = async (what) => {
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
    for (const { id, impact, nodes } of violations)
      checks.expect(!['serious', 'critical'].includes(impact), `${what}: ${impact}: ${id}: ${nodes.map((node) => node.target.join(' ')).join(', ')}`);
    console.log(`axe, ${what}: ${violations.length === 0 ? 'nothing' : violations.map((v) => `${v.impact}: ${v.id}`).join(', ')}`);
  };
  const close = async (what) => {
    checks.expect(complaints.length === 0, `${what}: ${complaints.join(' | ')}`);
    await context.close();
  };
  return { page, first, done, settled, text, save, picture, accessible, close };
}

// What a sample is, as a file for the program.
async function sampleFile(key, file, frame = null) {
  const { frames, ...options } = samples[key].mesh;
  const mesh = await Mesh.mannequin({ ...options, angles: frames ? frames[frame].angles : null });
  const shift = frames ? frames[frame].shift : [0, 0, 0];
  writeFileSync(file, mesh.write('ply', { positions: mesh.positions.map((x, i) => x + shift[i % 3]) }));
  mesh.close();
}

// The page as it comes, then a sequence.
async function withSamples() {
  const { page, first, done, text, save, picture, accessible, close } = await open({ acceptDownloads: true });
  console.log(`the first picture after ${first.toFixed(1)} s`);
  checks.expect(first < Number(process.env.NPT_FIRST_PICTURE ?? 30), `the first picture after ${first} s`);
  await done('samples');
  console.log(`samples: ${await text('result-said')}`);
  checks.expect(/by body estimation/i.test(await text('result-said')), await text('result-said'));
  await picture('desktop', 'web-desktop');
  await accessible('light');
  await sampleFile('character', 'character.ply');
  await sampleFile('leap', 'leap.ply');
  run('transfer', '--weights', weights, '--identity', 'character.ply', '--pose', 'leap.ply', '--out', 'leap-result.ply');
  const expected = (await read(Mesh, 'leap-result.ply')).positions;
  for (const format of ['obj', 'ply', 'glb']) checks.near(expected, (await read(Mesh, await save(format))).positions, `samples, saved as ${format}`);

  // Comparing.
  await page.selectOption('#compare', 'ground-truth');
  checks.expect(await page.locator('#legend').isVisible(), 'no legend');
  const off = /off ([\d.]+) mm/.exec(await page.locator('#captions p').nth(2).textContent());
  checks.expect(off && Number(off[1]) < 30, `off the ground truth: ${off && off[0]}`);
  await picture('truth');
  await page.selectOption('#compare', 'overlay');
  await picture('overlay');
  await page.selectOption('#compare', 'none');

  // By the keyboard: dark, wireframe, keys.
  await page.locator('#canvas').focus();
  await page.keyboard.press('d');
  await page.keyboard.press('w');
  checks.expect(await page.getAttribute('#wire', 'aria-pressed') === 'true', 'w draws no edges');
  await picture('dark');
  await accessible('dark');
  await page.keyboard.press('w');
  await page.keyboard.press('d');
  await page.keyboard.press('?');
  checks.expect(await page.locator('#keys').isVisible(), 'no list of keys');
  await page.keyboard.press('Escape');
  await page.evaluate(() => document.activeElement.blur());
  const controls = ['identity-sample', 'identity-file', 'pose-sample', 'pose-file', 'weights', 'compare', 'format', 'save', 'canvas', 'wire', 'theme', 'help'];
  for (const id of await unreached(page, 30, controls)) checks.expect(false, `${id} can't be reached by Tab`);

  // A sequence.
  await page.selectOption('#pose-sample', 'walk');
  await page.waitForFunction(() => document.getElementById('time').max === '23', null, { timeout: 240000 });
  await done('a sequence');
  checks.expect(await text('frame') === '1 / 24', `frame ${await text('frame')}`);
  await page.click('#play');
  checks.expect(await page.getAttribute('#play', 'aria-label') === 'Pause', 'it doesn\'t play');
  await page.waitForFunction(() => document.getElementById('frame').textContent !== '1 / 24', null, { timeout: 60000 });
  await page.click('#play');
  await page.locator('#time').fill('6');
  checks.expect(await text('frame') === '7 / 24', `frame ${await text('frame')}`);
  await picture('sequence');
  for (let i = 0; i < 24; ++i) await sampleFile('walk', `walk/frame_${String(i).padStart(2, '0')}.ply`, i);
  run('transfer', '--weights', weights, '--identity', 'character.ply', '--pose', 'walk', '--fps', '24', '--out', 'walk.glb');
  const [theirs, own] = [await read(Mesh, 'walk.glb'), await read(Mesh, await save('glb'))];
  checks.expect(own.clips.length === 1 && Math.abs(own.clips[0].length - theirs.clips[0].length) < 1e-6, JSON.stringify(own.clips));
  for (const i of [0, 7, 23]) {
    for (const mesh of [theirs, own]) mesh.moveTo(0, i / 24);
    checks.near(theirs.positions, own.positions, `the saved sequence, frame ${i + 1}`);
  }
  await close('samples');
}

// Files: picked and dropped; bad ones, after which all is as it was.
async function withFiles() {
  run('generate', '--shape-seed', '6', '--pose', 'rest', '--out', 'identity.obj');
  run('generate', '--shape-seed', '4', '--pose', 'natural', '--pose-seed', '14', '--out', 'pose.glb');
  run('transfer', '--weights', weights, '--identity', 'identity.obj', '--pose', 'pose.glb', '--out', 'result.ply');
  const { page, done, settled, text, save, picture, close } = await open({ acceptDownloads: true });
  await done('samples');
  const drop = async (files, share) => {
    const data = await page.evaluateHandle((list) => {
      const transfer = new DataTransfer();
      for (const { name, content } of list) transfer.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
      return transfer;
    }, files.map((name) => ({ name, content: readFileSync(name).toString('base64') })));
    const box = await page.locator('#stage').boundingBox();
    const place = { clientX: box.x + share * box.width, clientY: box.y + box.height / 2, dataTransfer: data, bubbles: true, cancelable: true };
    await page.dispatchEvent('#stage', 'dragover', place);
    await page.dispatchEvent('#stage', 'drop', place);
  };
  const named = (side, name) => page.waitForFunction(([id, wanted]) => document.getElementById(id).textContent.startsWith(wanted), [`${side}-said`, name], { timeout: 240000 });
  await drop(['identity.obj'], 0.1);
  await named('identity', 'identity.obj');
  await drop(['pose.glb'], 0.5);
  await named('pose', 'pose.glb');
  await done('files');
  checks.near((await read(Mesh, 'result.ply')).positions, (await read(Mesh, await save('ply'))).positions, 'dropped files, saved');
  await picture('files');

  const said = await text('result-said');
  writeFileSync('empty.obj', '');
  writeFileSync('picture.ply', 'not a mesh');
  writeFileSync('notes.txt', 'not a mesh');
  writeFileSync('bad.safetensors', Buffer.alloc(64));
  const refused = async (f, pattern, what, left = said) => {
    await f();
    await page.waitForFunction(() => !document.getElementById('notice').hidden, null, { timeout: 60000 });
    await settled();
    checks.expect(pattern.test(await text('notice-text')), `${what}: ${await text('notice-text')}`);
    console.log(`${what}: ${await text('notice-text')}`);
    const result = await text('result-said');
    checks.expect(await page.locator('#save').isEnabled() === (left === said) && result === left, `${what}: the result is '${result}', expected '${left}'`);
    checks.expect((await text('identity-said')).startsWith('identity.obj'), `${what}: the identity is gone`);
    await page.click('#notice-close');
  };
  await refused(() => page.setInputFiles('#identity-file', 'empty.obj'), /empty\.obj/, 'an empty file');
  await refused(() => page.setInputFiles('#pose-file', 'picture.ply'), /picture\.ply/, 'a file that is no mesh');
  await refused(() => drop(['notes.txt'], 0.1), /notes\.txt/, 'another format');
  await refused(() => page.setInputFiles('#weights-file', 'bad.safetensors'), /bad\.safetensors/, 'a file that is no weights');
  writeFileSync('correspondence.safetensors', partOf(readFileSync(weights), 'correspondence/'));
  await refused(() => page.setInputFiles('#weights-file', 'correspondence.safetensors'),
                /no weights of a pose transfer network.*correspondence\.safetensors/, 'weights of another network');
  checks.near((await read(Mesh, 'result.ply')).positions, (await read(Mesh, await save('obj'))).positions, 'after all that');

  // What is not recognised as a person: the reason why there is no result.
  writeFileSync('box.obj', 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n');
  await refused(() => page.setInputFiles('#pose-file', 'box.obj'), /box\.obj: found a mesh that is not recognised as a person/, 'a box',
                'None: what went wrong stands above the picture');
  await picture('notes');
  await close('files');
}

// A clip without a mesh onto a character's own joints; onto a mesh without joints; FBX, where there is one.
async function withJoints() {
  const bone = bonesMesh([{ parent: -1 }, { parent: 0 }, { parent: 1 }], Float32Array.of(0, 0, 0, 0, 1, 0, 0, 2, 0));
  checks.expect(bone.positions.length === 18 && bone.triangles.length === 24 && bone.positions[1] === 1 && bone.positions[16] === 2, 'a bone');
  run('generate', '--shape-seed', '6', '--pose', 'rest', '--out', 'figure.obj');
  run('rig', '--weights', weights, '--mesh', 'figure.obj', '--out', 'hero.glb');
  writeFileSync('walk.bvh', bvhWalk());
  run('transfer', '--identity', 'hero.glb', '--pose', 'walk.bvh', '--out', 'hero-by-npt.glb');
  const { page, done, text, save, picture, close } = await open({ acceptDownloads: true });
  await done('samples');
  const opened = async (side, file) => {
    await page.setInputFiles(`#${side}-file`, file);
    await page.waitForFunction(([id, name]) => document.getElementById(id).textContent.startsWith(name), [`${side}-said`, path.basename(file)], { timeout: 240000 });
    await done(file);
  };
  await opened('identity', 'hero.glb');
  await opened('pose', 'walk.bvh');
  checks.expect(/^On its own joints, confidence/.test(await text('result-said')), await text('result-said'));
  checks.expect(/21 joints, 13 frames/.test(await text('pose-said')), await text('pose-said'));
  await picture('joints');
  const theirs = await read(Motion, 'hero-by-npt.glb'), own = await read(Motion, await save('glb'));
  for (const time of [0, 0.3]) checks.near(theirs.positionsAt(time), own.positionsAt(time), `a clip on joints, saved, at ${time} s`, 1e-6);
  const bvh = await read(Motion, await save('bvh'));
  checks.expect(Math.abs(bvh.length - own.length) < 1e-3, `saved as BVH: ${bvh.length} s`);
  checks.near((await Mesh.read(readFileSync(await save('ply')), 'frame.ply')).positions, own.positionsAt(0), 'a frame, saved', 1e-5);
  await opened('identity', 'figure.obj');
  checks.expect(/^On joints of its estimated body/.test(await text('result-said')), await text('result-said'));
  checks.expect((await read(Motion, await save('glb'))).clip === 'walk', 'a clip on an estimated body');
  const fbx = fileURLToPath(new URL('../../../shared/data/clips/kenney_walk.fbx', import.meta.url));
  if (existsSync(fbx)) {
    await opened('identity', 'hero.glb');
    await opened('pose', fbx);
    checks.expect(/^On its own joints/.test(await text('result-said')), `FBX: ${await text('result-said')}`);
    checks.expect((await read(Motion, await save('glb'))).clip === 'Root|Walk', 'the clip of an FBX file');
  } else {
    console.log('FBX: skipped, no file');
  }
  writeFileSync('bad.fbx', 'no FBX');
  await page.setInputFiles('#pose-file', 'bad.fbx');
  await page.waitForFunction(() => !document.getElementById('notice').hidden, null, { timeout: 60000 });
  checks.expect(/^bad\.fbx: /.test(await text('notice-text')), await text('notice-text'));
  console.log(`no FBX: ${await text('notice-text')}`);
  await close('joints');
}

// The same with shared memory, which threads want.
async function withThreads() {
  const isolated = await serve(path.join(web, 'page'), true);
  const { page, done, text, save, close } = await open({ acceptDownloads: true }, isolated);
  await done('with threads');
  console.log(`isolated: ${await text('result-said')}`);
  const wanted = Math.min(4, availableParallelism());
  checks.expect(wanted === 1 || (await text('result-said')).includes(`on ${wanted} threads`), await text('result-said'));
  checks.near((await read(Mesh, 'leap-result.ply')).positions, (await read(Mesh, await save('ply'))).positions, 'with threads, saved');
  await page.selectOption('#weights', 'human-pooled');
  await page.waitForFunction(() => document.getElementById('result-said').textContent.startsWith('By the network'), null, { timeout: 120000 });
  await done('other weights with threads');
  run('transfer', '--weights', path.join(web, 'page/weights/human-pooled.safetensors'), '--method', 'network', '--identity', 'character.ply', '--pose', 'leap.ply',
      '--out', 'pooled.ply');
  checks.near((await read(Mesh, 'pooled.ply')).positions, (await read(Mesh, await save('obj'))).positions, 'by the pooled network with threads');
  await close('with threads');
  isolated.close();
}

async function onPhone() {
  const { page, done, text, picture, accessible, close } = await open({ viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true, colorScheme: 'dark' });
  await done('on a phone');
  checks.expect(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'a narrow window scrolls sideways');
  checks.expect(await page.evaluate(() => document.documentElement.dataset.theme) === 'dark', 'the system\'s dark is ignored');
  console.log(`on a phone: ${await text('result-said')}`);
  await picture('phone', 'web-phone');
  await accessible('on a phone');
  await close('on a phone');
}

try {
  await withSamples();
  await withFiles();
  await withJoints();
  await withThreads();
  await onPhone();
} finally {
  await browser.close();
  server.close();
}
checks.end();
