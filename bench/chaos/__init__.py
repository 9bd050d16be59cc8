"""Chaos missions, many: faults of every kind at random, everything that must hold checked at every step.

python -m bench.chaos --missions 1000 --seed 0
"""
