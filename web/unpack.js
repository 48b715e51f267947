// Arrays that Python wrote into the page as { type, data }, data in base64.
const TYPES = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };

/** The same value with every such array unpacked. */
export function unpack(value) {
  if (Array.isArray(value)) return value.map(unpack);
  if (value && typeof value === "object") {
    if (typeof value.data === "string" && value.type in TYPES) {
      const bytes = Uint8Array.from(atob(value.data), (c) => c.charCodeAt(0));
      return new TYPES[value.type](bytes.buffer);
    }
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, unpack(v)]));
  }
  return value;
}

/** Round numbers between two, about so many. */
export function ticks(low, high, about) {
  const raw = (high - low) / Math.max(about, 1), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw);
  const found = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9 * step; v += step) found.push(v);
  return found;
}
