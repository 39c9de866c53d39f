// Bundle src/ and try/ into one self-contained HTML file each, page.html.gz and try.html of ../tvist_view, and collect the licences.
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const out = process.argv[2] ?? "../tvist_view";

async function one(folder, entry, name) {
  const bundled = await build({
    entryPoints: [`${folder}/${entry}`],
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    legalComments: "none",
    loader: { ".css": "text", ".svg": "text" },
    write: false,
  });
  // A script in a page ends at the first "</script", even inside a string.
  const script = bundled.outputFiles[0].text.replaceAll("</script", "<\\/script").trim();
  const style = (await build({ entryPoints: [`${folder}/style.css`], bundle: true, minify: true, write: false })).outputFiles[0].text.trim();
  const page = readFileSync(`${folder}/page.html`, "utf8")
    .replace("/* style */", () => style)
    .replace("/* script */", () => script);
  writeFileSync(`${out}/${name}`, name.endsWith(".gz") ? gzipSync(page, { level: 9 }) : page);
}

await one("src", "main.js", "page.html.gz");
await one("try", "main.ts", "try.html");
const licences = ["three", "uplot"].map((name) => {
  const { version } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  return `${name} ${version}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}\n`;
});
writeFileSync(`${out}/page.licences.txt`, licences.join("\n"));
