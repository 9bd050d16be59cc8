"""Mutants of how missions are played side by side."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "bench/workers.py",
        "                outcome = died(seed)\n",
        "                continue\n",
        "a mission that kills the workers of a cluster is not told",
    ),
    Mutant(
        "bench/workers.py",
        "                    blamed.append(seed)\n",
        "                    yield died(seed)\n",
        "missions that waited for a worker are blamed for its loss",
    ),
    Mutant(
        "bench/workers.py",
        "            return self._died(seed)\n",
        "            raise\n",
        "a mission that dies ends all of them",
    ),
    Mutant(
        "bench/chaos/__main__.py",
        "        parser.error(str(error))\n",
        "        raise\n",
        "a cluster that is not there is a traceback",
    ),
)
