"""Find what a model is missing: where it disagrees with measured records, the name of the missing effect, and the model
with that effect added.

>>> found = hystgen.diagnose("stage.yaml", ["slow.csv", "steps.csv"], holdout=["other.csv"])
>>> found.verdict
>>> found.write("diagnosis/")
"""

from hystgen.diagnosis.findings.result import Diagnosis, Signals
from hystgen.diagnosis.run import diagnose
from hystgen.identification.pi import IdentificationError

__all__ = ["Diagnosis", "IdentificationError", "Signals", "diagnose"]
