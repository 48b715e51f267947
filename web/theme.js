// Light and dark: the button, the system's wish, and the colours that the page has now.

export const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export const isDark = () => style("--dark") === "1";

/** Lets the button change the theme; `recolour` is called whenever it has changed. */
export function themed(recolour) {
  document.getElementById("theme").addEventListener("click", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    recolour();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);
}

/** A colour as it can be told from the paper: dark ones are lightened on dark paper. */
export function shade(colour) {
  if (colour === "ink") return style("--ink");
  if (colour === "pale") return style("--pale");
  if (!isDark()) return colour;
  const parts = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const light = (0.21 * parts[0] + 0.72 * parts[1] + 0.07 * parts[2]) / 255;
  const mix = Math.max(0, 0.45 - light);
  return `rgb(${parts.map((p) => Math.round(p + (255 - p) * mix)).join(" ")})`;
}
