"""The workbench in a notebook: the page of `youla workbench` in a frame; what is chosen and found there comes back."""

from __future__ import annotations

import io
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from . import _native
from ._arrays import whole
from ._errors import InputError
from ._optional import need
from ._record import Record

# The frame says when it is ready, takes files and settings, and sends settings and summary as they change.
_FRAME = """
export default { render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  frame.title = "youla workbench";
  Object.assign(frame.style, { width: "100%", height: `${model.get("height")}px`, border: "0" });
  const heard = ({ source, data }) => {
    if (source !== frame.contentWindow || !data?.youla) return;
    if (data.youla.ready) return frame.contentWindow.postMessage({ youla: { files: model.get("files"), settings: model.get("settings") } }, "*");
    for (const key of ["settings", "summary"]) if (data.youla[key] != null) model.set(key, data.youla[key]);
    model.save_changes();
  };
  addEventListener("message", heard);
  frame.srcdoc = model.get("page");
  el.append(frame);
  return () => removeEventListener("message", heard);
} };
"""


def workbench(record: Record | str | Path | None = None, *, height: int = 900) -> Any:
    """The workbench as a widget: log, check, model, and the loop of other gains, in the page itself.

    Parameters
    ----------
    record : Record, str or path, optional
        What the page begins with: a record, or a file as it is dropped on the page. Nothing leaves the browser.
    height : int, optional
        Height of the frame, pixels.

    Returns
    -------
    anywidget.AnyWidget
        Its `settings` are run.toml as the page has it now, its `summary` is that of the result shown, as in `Run.summary`;
        both follow the page (`widget.observe`).

    Raises
    ------
    InputError
        For what is no record and no file, and where anywidget is not installed.

    Examples
    --------
    >>> import numpy as np, youla
    >>> log = youla.Record(np.random.default_rng(1).standard_normal((1000, 2)), inputs=0, outputs=1, dt=1e-3)
    >>> bench = youla.workbench(log)                       # doctest: +SKIP
    >>> bench.settings, bench.summary                      # after clicking # doctest: +SKIP
    """
    widgets, traits = need("anywidget"), need("traitlets")
    files, settings = _contents(record)
    synced = {
        "page": traits.Unicode(_page()).tag(sync=True),
        "files": traits.Dict(files).tag(sync=True),
        "settings": traits.Unicode(settings).tag(sync=True),
        "summary": traits.Dict().tag(sync=True),
        "height": traits.Int(whole(height, "height", 1, 100_000)).tag(sync=True),
    }
    return type("Workbench", (widgets.AnyWidget,), {"_esm": _FRAME, **synced})()


def _page() -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "workbench.html"
        _native.program(["youla", "workbench", "--no-open", "--quiet", "--out", str(path)])
        return path.read_text(encoding="utf-8")


def _contents(record: Record | str | Path | None) -> tuple[dict[str, bytes], str]:
    """The files of the page, and its settings; without settings a file is as if it were dropped."""
    if record is None:
        return {}, ""
    if isinstance(record, Record):
        return _of_record(record)
    if not isinstance(record, (str, Path)):
        raise InputError(f"record is {type(record).__name__}, but must be a youla.Record or the path of a file")
    path = Path(record)
    if not path.is_file():
        raise InputError(f"record is {str(record)!r}, but there is no such file")
    return {path.name: path.read_bytes()}, ""


def _of_record(record: Record) -> tuple[dict[str, bytes], str]:
    groups = {"inputs": record.u, "outputs": record.y, "input_excitation": record.excitation, "reference": record.reference}
    letters = {"inputs": "u", "outputs": "y", "input_excitation": "d", "reference": "r"}
    names = {"inputs": record.inputs, "outputs": record.outputs}
    arrays: dict[str, Any] = {}
    lines = ["name = " + json.dumps(record.name), "[data]", f"sample_time = {record.dt!r}"]
    for key, values in groups.items():
        if values is None:
            continue
        channels = []
        for k, column in enumerate(values.T):
            place = f"{letters[key]}{k + 1}"
            arrays[place] = np.ascontiguousarray(column)
            name = names[key][k] if key in names else place
            channels.append(f"{{ name = {json.dumps(name)}, from = {json.dumps(place)} }}")
        lines.append(f"{key} = [{', '.join(channels)}]")
    part = 2 * len(record) // 3
    lines += [f'estimation = [{{ file = "record.npz", take = {part} }}]', f'verification = [{{ file = "record.npz", skip = {part}, name = "second part" }}]']
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    return {"record.npz": packed.getvalue()}, "\n".join(lines) + "\n"
