"use strict";

// Unpacks the data and the scripts, which lie in the page as gzip in base64, and runs the scripts.

async function unpacked(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

function runScript(text) {
  const script = document.createElement("script");
  script.textContent = text;
  document.body.append(script);
}

let unpackedData = "";

async function boot() {
  if (typeof DecompressionStream === "undefined") {
    document.getElementById("content").textContent = "This page needs a browser of 2023 or later.";
    return;
  }
  const [data, ...scripts] = await Promise.all(["data", "plotly", "page-script"].map(unpacked));
  unpackedData = data;
  scripts.forEach(runScript);
}
boot().catch((error) => {
  document.getElementById("content").textContent = `This page is damaged: ${error.message}`;
});
