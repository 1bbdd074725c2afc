"use strict";
/* Drives as `packing.py` packs them, taken apart again. */

/** The bytes of deflated base64. */
async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The arrays of a packed drive; `missing` is the whole number in place of a value that is not a number. */
async function unpackArrays(content, missingNumber) {
  const raw = await inflated(content.data);
  let begin = 0;
  return content.arrays.map(({ n, planes, step, log, missing }) => {
    const out = missing ? new Array(n) : new Float64Array(n);
    let whole = 0, slope = 0;
    for (let k = 0; k < n; k++) {
      let folded = 0;
      for (let p = planes - 1; p >= 0; p--) folded = folded * 256 + raw[begin + p * n + k];
      slope += folded % 2 ? -(folded + 1) / 2 : folded / 2;
      whole += slope;
      out[k] = missing && whole === missingNumber ? null : log ? Math.pow(2, whole * step) : whole * step;
    }
    begin += n * planes;
    return out;
  });
}
