// Draws the diagrams of a page, in the colours that the reader's system asks for.
mermaid.initialize({ theme: matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "neutral", securityLevel: "strict" });
