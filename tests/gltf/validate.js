// Khronos' validator on GLB files: node validate.js FILE... ; fails where one has errors.
const fs = require('fs');
const validator = require('gltf-validator');

(async () => {
  let errors = 0;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 20});
    const {numErrors, numWarnings} = report.issues;
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings`);
    for (const issue of report.issues.messages)
      if (issue.severity < 1) console.log(`  ${issue.code} ${issue.message} ${issue.pointer || issue.offset}`);
    errors += numErrors;
  }
  process.exit(errors === 0 && process.argv.length > 2 ? 0 : 1);
})();
