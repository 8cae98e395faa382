// Draws the diagrams of a page, in the colours that the reader's system asks for. The labels of arrows stand on the page's
// colour for code: the themes' own grey is too near to the dark theme's letters.
const dark = matchMedia("(prefers-color-scheme: dark)").matches;
mermaid.initialize({
  theme: dark ? "dark" : "neutral",
  themeVariables: { edgeLabelBackground: dark ? "#23272c" : "#f4f5f6" },
  securityLevel: "strict",
});
