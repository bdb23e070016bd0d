import json

import numpy as np
import pytest

from toddle.outside.records import put_together, taken_apart
from toddle.reach.model.model import Fit
from toddle.reach.model.rigid import Rigid
from toddle.robots.linkage import Linkage

CLASSES = {"Fit": Fit, "Rigid": Rigid, "Linkage": Linkage}


@pytest.fixture
def fit():
    linkage = Linkage(np.eye(4)[None], np.zeros(1), np.ones((1, 1)), np.zeros(1), np.eye(4))
    return Fit(Rigid(linkage, np.eye(13)), "screws", np.arange(3.0), 1e-3, np.zeros(3, bool), 0.1, ("a note",))


def test_a_value_comes_back_as_it_was(fit):
    tensors = {}
    facts = json.loads(json.dumps(taken_apart(fit, "fit", tensors)))
    again = put_together(facts, tensors, CLASSES)
    assert again.notes == fit.notes
    assert again.model.coordinates == fit.model.coordinates
    np.testing.assert_array_equal(again.model.linkage.before, fit.model.linkage.before)
    assert set(tensors) >= {"fit.miss", "fit.wild", "fit.model.covariance", "fit.model.linkage.tip"}


def test_a_class_that_nobody_named_is_never_made(fit):
    facts = taken_apart(fit, "fit", tensors := {})
    facts["fields"]["model"]["class"] = "Popen"
    with pytest.raises(KeyError):
        put_together(facts, tensors, CLASSES)
    with pytest.raises(ValueError, match="has fields"):
        put_together({"class": "Linkage", "fields": {"before": 1}}, {}, CLASSES)


def test_what_it_can_t_hold_is_told():
    with pytest.raises(TypeError, match="value is a function"):
        taken_apart(lambda: None, "value", {})
