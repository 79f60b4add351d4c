// build.mjs SOURCE BUILD: makes the page of `kinespace view` from SOURCE/src. Into BUILD go
//   page.html   one file with scripts and styles in it, and a place for the data
//   page.cpp    the same as a string of the command
//   motion.mjs  the reader of a library's motion, as a module for Node
// BUILD/node_modules has esbuild.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";

const [source, build] = process.argv.slice(2).map((path) => resolve(path));
const esbuild = createRequire(join(build, "package.json"))("esbuild");

function bundle(entry, options) {
  const done = esbuild.buildSync({
    entryPoints: [join(source, "src", entry)],
    bundle: true,
    write: false,
    logLevel: "warning",
    target: ["es2022", "chrome110", "firefox115", "safari16"],
    charset: "ascii",
    ...options,
  });
  return done.outputFiles[0].text;
}

// What stands in a script element must not end it.
const script = bundle("main.ts", { format: "iife", minify: true }).replaceAll("</script", "<\\/script");
const style = bundle("page.css", { minify: true });
const page = readFileSync(join(source, "src", "page.html"), "utf8")
  .replace("<!--kinespace-style-->", () => `<style>${style}</style>`)
  .replace("<!--kinespace-script-->", () => `<script>${script}</script>`);

writeFileSync(join(build, "motion.mjs"), bundle("motion.ts", { format: "esm", platform: "neutral" }));
writeFileSync(join(build, "page.html"), page);

// In pieces, since compilers have a longest string.
const delimiter = "kinespace";
if (page.includes(`)${delimiter}"`)) throw new Error("the page holds the end of the string that it becomes");
const pieces = page.match(/[^]{1,8000}/gu).map((piece) => `R"${delimiter}(${piece})${delimiter}"`);
writeFileSync(
  join(build, "page.cpp"),
  `// Made from viewer/src by viewer/build.mjs.
#include <string_view>

namespace kinespace::cli {
std::string_view empty_page();
std::string_view empty_page() {
  return ${pieces.join("\n")};
}
}  // namespace kinespace::cli
`,
);
