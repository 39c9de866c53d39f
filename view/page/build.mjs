// Bundles src/ into one HTML file that loads nothing: ../tvist_view/page.html, with its licences beside it.
import { readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const out = process.argv[2] ?? "../tvist_view";
const bundled = await build({
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  loader: { ".css": "text", ".svg": "text" },
  write: false,
});
// A script in a page ends at the first "</script", also inside a string.
const script = bundled.outputFiles[0].text.replaceAll("</script", "<\\/script").trim();
const style = (await build({ entryPoints: ["src/style.css"], bundle: true, minify: true, write: false })).outputFiles[0].text.trim();
const page = readFileSync("src/page.html", "utf8")
  .replace("/* style */", () => style)
  .replace("/* script */", () => script);
writeFileSync(`${out}/page.html`, page);
const licences = ["three", "uplot"].map((name) => {
  const { version } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  return `${name} ${version}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}\n`;
});
writeFileSync(`${out}/page.licences.txt`, licences.join("\n"));
