// The method from the page's side: requests, cancellation, the files that a fresh worker needs.

// The page before any script has changed it, up to this script, behind which a saved page has its data: what is saved.
const own = document.documentElement.outerHTML;

const engine = (() => {
  /** @type {Map<string, Uint8Array>} */
  const files = new Map();
  /** @type {Map<number, { message: any, resolve: (answer: any) => void, said?: (line: string) => void }>} */
  const open = new Map();
  const source = /** @type {HTMLElement} */ (document.getElementById("worker-source")).textContent ?? "";
  let next = 1;
  /** @type {Worker} */
  let worker;
  /** @type {Promise<void>} */
  let ready;

  function packed() {
    const text = atob((document.getElementById("method")?.textContent ?? "").trim()), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
    return bytes;
  }

  function start() {
    const address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    worker = new Worker(address);
    ready = new Promise((resolve, reject) => worker.addEventListener("message", ({ data }) => {
      if (data.ready) return resolve();
      if (data.failed) return reject(new Error(data.failed));
      const asked = open.get(data.id);
      if (data.line != null) return asked?.said?.(data.line);
      open.delete(data.id);
      for (const [path, bytes] of data.files ?? []) files.set(path, bytes);
      asked?.resolve(data.answer);
    }));
    worker.postMessage({ packed: packed(), files: [...files] });
    URL.revokeObjectURL(address);
  }

  return {
    files,
    start,
    ready: () => ready,
    /** Adds a file. @param {string} path @param {Uint8Array} bytes */
    put(path, bytes) { files.set(path, bytes); worker.postMessage({ files: [[path, bytes]] }); },
    /** Asks the method; files whose paths begin with `collect` come back into `files`.
     * @param {any} request @param {{ said?: (line: string) => void, collect?: string }} [options] @returns {Promise<any>} */
    ask(request, { said, collect } = {}) {
      return new Promise(resolve => {
        const id = next++, message = { id, request, collect };
        open.set(id, { message, resolve, said });
        worker.postMessage(message);
      });
    },
    /** Ends an identification; what else was asked for is asked again of a fresh worker. */
    cancel() {
      worker.terminate();
      start();
      for (const [id, { message, resolve }] of [...open]) {
        if (message.request.verb !== "identify") { worker.postMessage(message); continue; }
        open.delete(id);
        resolve({ error: "Cancelled.", cancelled: true });
      }
    },
  };
})();
