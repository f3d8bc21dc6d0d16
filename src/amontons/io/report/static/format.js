// Numbers as text, elements of the page, and the arrays of the file.

/** A number with a few digits, a true minus sign, powers of ten where it is far from one. */
function text(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const told = size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  const [digitsOf, power] = told.split("e");
  const short = digitsOf.includes(".") ? digitsOf.replace(/\.?0+$/, "") : digitsOf;
  return (power === undefined ? short : `${short}e${Number(power)}`).replace("-", "−");
}

/** A name with its unit. */
const withUnit = (name, unit) => (unit ? `${name} in ${unit}` : name);

/** An element with attributes and children; text never becomes markup. */
function make(tag, attributes = {}, ...children) {
  const drawn = ["svg", "path", "line", "circle", "rect", "text", "g", "title"].includes(tag);
  const element = drawn ? document.createElementNS("http://www.w3.org/2000/svg", tag)
                        : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false && value !== null) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

const byId = (id) => document.getElementById(id);

/** The arrays of the file: a function from a reference in its JSON to numbers. */
async function unpack(block) {
  const raw = Uint8Array.from(atob(block), (letter) => letter.charCodeAt(0));
  const inflated = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(inflated).arrayBuffer();
  const kinds = { f4: Float32Array, i2: Int16Array, u2: Uint16Array, u4: Uint32Array };
  return (place) => {
    const stored = new kinds[place.type](buffer, place.at, place.n);
    const step = place.step;
    return step === undefined || step === 1 ? stored : Float32Array.from(stored, (x) => x * step);
  };
}

/** Colours of a perceptually even map (viridis), dark to light. */
const MAP = ["440154", "481769", "472a7a", "433d84", "3d4e8a", "355e8d", "2e6d8e", "297b8e",
  "23898e", "1f978b", "21a585", "2eb37c", "46c06f", "65cb5e", "89d548", "b0dd2f", "d8e219", "fde725"];
const STATUSES = ["open", "slip", "stick"];
/** The value of a colour of the style sheet. */
const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const seriesColour = (colour) =>
  `var(--${typeof colour === "number" ? `s${colour % 6}` : colour === "open" ? "open-line" : colour})`;
