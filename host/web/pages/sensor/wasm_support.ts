// Whether this browser can run the core at all.

// Modules with one function: it makes a vector of zeros (SIMD); it has a try block (exceptions).
const SIMD = [
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
];
const EXCEPTIONS = [
  0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 8, 1, 6, 0, 6, 64, 25, 11, 11,
];
const REMEDY = 'use a current Chromium, Chrome, Edge, Firefox or Safari';

/** Throws an Error with one line for people. */
export function checkWebAssembly(): void {
  if (typeof WebAssembly !== 'object')
    throw new Error(`this browser does not run WebAssembly; ${REMEDY}, and allow it there`);
  if (!WebAssembly.validate(new Uint8Array(SIMD)))
    throw new Error(`this browser's WebAssembly has no SIMD; ${REMEDY}`);
  if (!WebAssembly.validate(new Uint8Array(EXCEPTIONS)))
    throw new Error(`this browser's WebAssembly has no exceptions; ${REMEDY}`);
}
