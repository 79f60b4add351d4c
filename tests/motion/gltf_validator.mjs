// Runs the Khronos glTF validator over files:  node gltf_validator.mjs NODE_MODULES FILE...
// One line a finding of severity error or warning on standard error. Exit code 0: no errors; 1: errors; 3: no validator there.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';

const [folder, ...files] = process.argv.slice(2);
let validator;
try {
  validator = createRequire(resolve(folder, 'anchor.js'))(resolve(folder, 'gltf-validator'));
} catch (error) {
  console.error(`gltf-validator is not in ${folder}: ${error.message}`);
  process.exit(3);
}

let errors = 0;
for (const file of files) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 50 });
  errors += issues.numErrors;
  for (const { severity, code, message, pointer, offset } of issues.messages) {
    if (severity <= 1) console.error(`${file}: ${severity === 0 ? 'error' : 'warning'} ${code} ${pointer ?? offset}: ${message}`);
  }
}
process.exit(errors === 0 ? 0 : 1);
