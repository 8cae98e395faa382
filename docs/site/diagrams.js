// Draws the diagrams of a page, in the colours that the reader's system asks for. Charts and the labels of arrows stand on
// the page's colour for code: the themes' own grey is too near to the dark theme's letters. A chart's theme is given whole,
// since what is left out becomes the light theme's.
const dark = matchMedia("(prefers-color-scheme: dark)").matches;
const ground = dark ? "#23272c" : "#f4f5f6", ink = dark ? "#e8ebee" : "#22272c";
const chart = { backgroundColor: ground, plotColorPalette: dark ? "#8fc1f0" : "#1d5a94", titleColor: ink };
for (const axis of ["xAxis", "yAxis"])
  for (const part of ["Label", "Title", "Tick", "Line"]) chart[`${axis}${part}Color`] = ink;
mermaid.initialize({
  theme: dark ? "dark" : "neutral",
  themeVariables: { edgeLabelBackground: ground, xyChart: chart },
  securityLevel: "strict",
});
