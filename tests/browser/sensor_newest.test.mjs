// Which of a camera's pictures the tab's worker takes: the newest, one at a time, and every other one is given back to the camera.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { reason } from './support/environment.mjs';
import { loadModule } from './support/typescript.mjs';

const skip = reason('packages');
let Newest;

before(async () => {
  if (!skip) ({ Newest } = await loadModule('sensor/newest.ts'));
});

/** A queue whose work lasts until `finish()`, with what was taken and what was closed, by name. */
function queue() {
  const self = { taken: [], closed: [], picture: (name) => ({ name, close: () => self.closed.push(name) }) };
  self.newest = new Newest((picture) => {
    self.taken.push(picture.name);
    return new Promise((finish) => (self.finish = finish));
  });
  return self;
}

test('while one picture is worked on the newest waits, and those that it replaces are closed', { skip }, async () => {
  const { newest, picture, ...seen } = queue();
  for (const name of ['first', 'second', 'third']) newest.put(picture(name));
  assert.deepEqual([seen.taken, seen.closed], [['first'], ['second']]);
});

test('what waited is worked on next, and closed by nobody else', { skip }, async () => {
  const self = queue();
  for (const name of ['first', 'second', 'third']) self.newest.put(self.picture(name));
  self.finish();
  await new Promise(setImmediate);
  assert.deepEqual([self.taken, self.closed], [['first', 'third'], ['second']]);
});

test('a picture that waits when the camera stops is closed, and never worked on', { skip }, async () => {
  const self = queue();
  for (const name of ['first', 'second']) self.newest.put(self.picture(name));
  self.newest.clear();
  self.finish();
  await new Promise(setImmediate);
  assert.deepEqual([self.taken, self.closed], [['first'], ['second']]);
});
