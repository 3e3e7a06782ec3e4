// run.toml: the one description of what is asked for. Every click changes it; undo and redo go through its texts.

const settings = (() => {
  /** @type {any} */
  let table = { name: "log", data: { inputs: [], outputs: [] } };
  /** @type {string[]} */
  let past = [], future = [];
  let text = "";
  /** Changes follow each other: each begins from the tables and the text of the one before. */
  let settled = Promise.resolve();
  /** @type {((table: any) => void)[]} */
  const listeners = [];

  async function written() {
    const answer = await engine.ask({ verb: "toml", table });
    if (!answer.error) text = answer.toml;
  }

  function tell() { listeners.forEach(listener => listener(table)); }

  return {
    /** The tables; change them by `change` only. */
    get table() { return table; },
    get text() { return text; },
    get canUndo() { return past.length > 0; },
    get canRedo() { return future.length > 0; },
    /** Calls all listeners again. */
    told: tell,
    /** @param {(table: any) => void} listener */
    listen(listener) { listeners.push(listener); },
    /** When every change so far is in the text. */
    settled: () => settled,
    /** Changes the tables and remembers the text before. @param {(table: any) => void} how */
    change: how => settled = settled.then(async () => {
      const changed = structuredClone(table);
      how(changed);
      if (JSON.stringify(changed) === JSON.stringify(table)) return;
      if (text) past.push(text);
      [table, future] = [changed, []];
      await written();
      tell();
    }),
    /** Takes a whole text, as the user has written it. @param {string} written @returns {Promise<string | null>} why it cannot be read */
    async read(written, remember = true) {
      const answer = await engine.ask({ verb: "table", toml: written });
      if (answer.error) return answer.error;
      if (remember && text && written !== text) { past.push(text); future = []; }
      [table, text] = [answer, written];
      table.data = { inputs: [], outputs: [], ...table.data };
      tell();
      return null;
    },
    async undo() { const before = past.pop(); if (before != null) { future.push(text); await this.read(before, false); } },
    async redo() { const after = future.pop(); if (after != null) { past.push(text); await this.read(after, false); } },
  };
})();
