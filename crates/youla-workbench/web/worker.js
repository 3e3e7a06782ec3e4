// The method in a worker: an in-memory file system, one fresh instance of the program for each request.

const { WASI, File: Stored, Directory, PreopenDirectory, OpenFile, ConsoleStdout } = wasiShim;
/** @type {Map<string, any>} */
const root = new Map();
/** @type {Promise<WebAssembly.Module>} */
let method;

/** Unpacks and compiles the method. @param {Uint8Array<ArrayBuffer>} packed */
async function compiled(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

/** Puts a file in its place, with the folders above it. @param {string} path @param {Uint8Array} bytes */
function put(path, bytes) {
  const parts = path.split("/"), name = /** @type {string} */ (parts.pop());
  let folder = root;
  for (const part of parts) {
    let next = folder.get(part);
    if (!(next instanceof Directory)) folder.set(part, next = new Directory(new Map()));
    folder = next.contents;
  }
  folder.set(name, new Stored(bytes));
}

/** Files whose paths begin with `prefix`. @param {string} prefix @returns {[string, Uint8Array][]} */
function collected(prefix) {
  const found = [];
  const walk = (/** @type {Map<string, any>} */ folder, /** @type {string} */ path) => {
    for (const [name, inode] of folder) {
      const inner = path ? `${path}/${name}` : name;
      if (inode instanceof Directory) walk(inode.contents, inner);
      else if (inner.startsWith(prefix)) found.push(/** @type {[string, Uint8Array]} */ ([inner, inode.data]));
    }
  };
  walk(root, "");
  return found;
}

/** Runs the method once. @param {object} request @param {(line: string) => void} said */
async function run(request, said) {
  const decoder = new TextDecoder(), parts = /** @type {Uint8Array[]} */ ([]), last = /** @type {string[]} */ ([]);
  const input = new OpenFile(new Stored(new TextEncoder().encode(JSON.stringify(request))));
  const output = new ConsoleStdout(bytes => { parts.push(bytes.slice()); });
  const errors = ConsoleStdout.lineBuffered(line => { last.push(line); said(line); });
  const wasi = new WASI(["youla-workbench"], [], [input, output, errors, new PreopenDirectory(".", root)], { debug: false });
  const instance = await WebAssembly.instantiate(await method, { wasi_snapshot_preview1: wasi.wasiImport });
  try {
    wasi.start(/** @type {any} */ (instance));
  } catch (problem) {
    return { error: `The method ended unexpectedly (${last.slice(-2).join(" ") || problem}). The log and the settings are as they were.`, exit: 101 };
  }
  const bytes = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  parts.reduce((at, part) => (bytes.set(part, at), at + part.length), 0);
  return JSON.parse(decoder.decode(bytes));
}

// One request after the other.
let queue = Promise.resolve();
addEventListener("message", ({ data }) => {
  if (data.packed) method = compiled(data.packed);
  for (const [path, bytes] of data.files ?? []) put(path, bytes);
  if (!data.request) return void (data.packed && method.then(() => postMessage({ ready: true }), problem => postMessage({ failed: String(problem) })));
  queue = queue.then(async () => {
    const answer = await run(data.request, line => postMessage({ id: data.id, line }));
    postMessage({ id: data.id, answer, files: data.collect && !answer.error ? collected(data.collect) : [] });
  });
});
