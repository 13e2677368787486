// Light and dark: the system's choice until the reader makes another one. Colours are the variables of style.css; a
// picture names roles, never colours.

const root = document.documentElement;
const system = window.matchMedia("(prefers-color-scheme: dark)");
let chosen = null;

export const isDark = () => root.dataset.theme === "dark";

export function colour(role) {
  return getComputedStyle(root).getPropertyValue(`--${role}`).trim();
}

export function withAlpha(hex, alpha) {
  const value = parseInt(hex.slice(1), 16);
  return `rgba(${value >> 16}, ${(value >> 8) & 255}, ${value & 255}, ${alpha})`;
}

// Calls `changed` whenever the colours change.
export function startTheme(button, changed) {
  const apply = () => {
    root.dataset.theme = chosen ?? (system.matches ? "dark" : "light");
    button.textContent = isDark() ? "☀ Light" : "☾ Dark";
  };
  apply();
  system.addEventListener("change", () => { apply(); changed(); });
  button.addEventListener("click", () => { chosen = isDark() ? "light" : "dark"; apply(); changed(); });
}

const steps = (hexes) => hexes.map((hex, k) => [k / (hexes.length - 1), hex]);

// From nothing to much, and from below to above zero. Both are legible in print and to the colour-blind.
export function colourScale(diverging) {
  if (diverging) {
    return isDark() ? steps(["#f0a45c", "#8a6237", "#1f262e", "#3a6796", "#6cb2ff"])
                    : steps(["#b35806", "#f1a340", "#f7f7f7", "#67a9cf", "#1763b6"]);
  }
  return isDark() ? steps(["#1c2a3a", "#1f4e7a", "#2f86b8", "#6cc5c1", "#f4f1a6"])
                  : steps(["#f4f8fb", "#b9dbe8", "#5fb0cf", "#1f74ad", "#0b2f5c"]);
}
