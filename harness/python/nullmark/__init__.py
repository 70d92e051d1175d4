"""Trackers over numpy arrays, judged by the nullmark program; see harness/python/python.md."""

from .judging import Verdict, judge, results
from .tracker import Ray, Samples, tracker

__all__ = ["Ray", "Samples", "Verdict", "judge", "results", "tracker"]
