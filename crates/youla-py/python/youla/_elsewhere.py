"""Names that are looked for in the package, but are methods of its objects or commands of the program."""

from __future__ import annotations

from typing import NoReturn

#: Where what has another name is, by the name under which it is looked for.
_PLACES = {
    "bode": "run.plot.bode() and run.frequency_response().plot() draw it",
    "commission": "it is of the program alone, `youla commission campaign.toml`; from Python run subprocess.run(['youla', 'commission', ...])",
    "export": "model.save(path) writes JSON, model.to_control() and model.to_scipy() convert, and the program writes C, MATLAB and others: "
    "run.save('folder'), then `youla export folder --to c`",
    "fit": "run.fits holds the fits, run.plot.fit() draws them",
    "nyquist": "run.plot.nyquist() draws it",
    "plot": "run.plot draws the figures of a run, such as run.plot.bode()",
    "read": "youla.Record(path, ...) reads a log, youla.Channels.read(path) one with time stamps of its own for each channel",
    "report": "run.report('report.html') writes it",
    "save": "run.save('folder') and model.save('model.json') write",
    "simulate": "model.simulate(inputs) simulates a model, youla.simulate_loop a loop",
    "synchronise": "youla.Channels(...).synchronise(dt=...) does it",
    "verify": "give identify the records by verify=",
}


def absent(name: str) -> NoReturn:
    """Say where a name is that the module has not."""
    place = f"; {_PLACES[name]}" if name in _PLACES else ""
    raise AttributeError(f"module 'youla' has no attribute {name!r}{place}", name=name)
