"""Diagnoses of the simulated campaigns, each made once for all tests that ask for it."""

from functools import cache

from campaigns import CAMPAIGNS
from forklift import Campaign, Truck, diagnose
from forklift.diagnosis.result import Diagnosis


@cache
def diagnosed(name: str) -> Diagnosis:
    return diagnose(Campaign.read(CAMPAIGNS / name), Truck.read("thesis"))
