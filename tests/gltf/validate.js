// Khronos' validator on GLB files: node validate.js FILE... ; fails where one has errors, or, as FILE=ORIGINAL, more than another.
const fs = require('fs');
const validator = require('gltf-validator');

(async () => {
  const reportOf = file => validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 20});
  let errors = 0;
  for (const argument of process.argv.slice(2)) {
    const [file, original] = argument.split('=');
    const report = await reportOf(file);
    const {numErrors, numWarnings} = report.issues;
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings`);
    for (const issue of report.issues.messages)
      if (issue.severity < 1) console.log(`  ${issue.code} ${issue.message} ${issue.pointer || issue.offset}`);
    errors += Math.max(0, numErrors - (original ? (await reportOf(original)).issues.numErrors : 0));
  }
  process.exit(errors === 0 && process.argv.length > 2 ? 0 : 1);
})();
