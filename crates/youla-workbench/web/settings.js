// run.toml: the one description of what is asked for, and the gains on trial. Every click changes one of them; undo and redo go through both.

const settings = (() => {
  /** @type {any} */
  let table = { name: "log", data: { inputs: [], outputs: [] } };
  /** @type {{ text: string, trial: any }[]} */
  let past = [], future = [];
  let text = "";
  /** The controller on trial, as [controller] of run.toml; null for the one that ran. @type {any} */
  let trial = null;
  /** Changes follow each other: each begins from the tables and the text of the one before. */
  let settled = Promise.resolve();
  /** @type {((table: any, onlyTrial: boolean) => void)[]} */
  const listeners = [];

  async function written() {
    const answer = await engine.ask({ verb: "toml", table });
    if (!answer.error) text = answer.toml;
  }

  function remember() {
    past.push({ text, trial });
    future = [];
  }

  function tell(onlyTrial = false) { listeners.forEach(listener => listener(table, onlyTrial)); }

  return {
    /** The tables; change them by `change` only. */
    get table() { return table; },
    get text() { return text; },
    get trial() { return trial; },
    get canUndo() { return past.length > 0; },
    get canRedo() { return future.length > 0; },
    /** Calls all listeners again. */
    told: () => tell(),
    /** @param {(table: any, onlyTrial: boolean) => void} listener told whether nothing but the trial has changed */
    listen(listener) { listeners.push(listener); },
    /** When every change so far is in the text. */
    settled: () => settled,
    /** Changes the tables and remembers the text before. @param {(table: any) => void} how */
    change: how => settled = settled.then(async () => {
      const changed = structuredClone(table);
      how(changed);
      if (JSON.stringify(changed) === JSON.stringify(table)) return;
      if (text) remember();
      table = changed;
      await written();
      tell();
    }),
    /** Puts a controller on trial, or none. @param {any} next */
    try: next => settled = settled.then(() => {
      if (JSON.stringify(next) === JSON.stringify(trial)) return;
      remember();
      trial = next;
      tell(true);
    }),
    /** Takes a whole text, as the user has written it. @param {string} written @returns {Promise<string | null>} why it cannot be read */
    async read(written, keep = true) {
      const answer = await engine.ask({ verb: "table", toml: written });
      if (answer.error) return answer.error;
      if (keep && text && written !== text) remember();
      [table, text] = [answer, written];
      table.data = { inputs: [], outputs: [], ...table.data };
      tell();
      return null;
    },
    /** Goes to a text and a trial. @param {{ text: string, trial: any }} to */
    async restore(to) {
      trial = to.trial;
      if (to.text && to.text !== text) await this.read(to.text, false); else tell(true);
    },
    async undo() { const before = past.pop(); if (before) { future.push({ text, trial }); await this.restore(before); } },
    async redo() { const after = future.pop(); if (after) { past.push({ text, trial }); await this.restore(after); } },
  };
})();
