// node run.mjs FILE: runs one file of tests for CTest, which knows a whole test program only. Exit status 0 if something was
// tested and nothing failed, 1 if something failed, 77 (skipped) if every test was skipped; the reasons are printed.
import { run } from 'node:test';
import { spec } from 'node:test/reporters';
import { resolve } from 'node:path';

process.exitCode = 1; // until the end is reached
const count = { passed: 0, failed: 0, skipped: 0 };
const reasons = new Set();
const isTest = (event) => event.details?.type !== 'suite' && event.name !== resolve(process.argv[2]);

const stream = run({ files: [resolve(process.argv[2])], concurrency: 1 });
stream.on('test:pass', (event) => {
  if (!isTest(event)) return;
  if (event.skip === undefined) {
    ++count.passed;
  } else {
    ++count.skipped;
    reasons.add(`skipped: ${event.name}: ${event.skip}`);
  }
});
stream.on('test:fail', () => ++count.failed);
const text = stream.compose(new spec());
text.pipe(process.stdout);
text.on('end', () => {
  for (const reason of reasons) console.log(reason);
  if (count.failed === 0) process.exitCode = count.passed > 0 ? 0 : 77;
});
