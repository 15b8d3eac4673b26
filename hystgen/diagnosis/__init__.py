"""Compare a model with measured records, name the effects that it is missing, and add them to the model.

>>> found = hystgen.diagnose("stage.yaml", ["slow.csv", "steps.csv"], holdout=["other.csv"])
>>> found.verdict
>>> found.write("diagnosis/")
"""

from hystgen.diagnosis.findings.result import Diagnosis, Signals
from hystgen.diagnosis.run import diagnose
from hystgen.identification.pi import IdentificationError

__all__ = ["Diagnosis", "IdentificationError", "Signals", "diagnose"]
