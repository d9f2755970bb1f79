"""An actor whose style is known, a user without one, and the actor's Persona; made once."""

import numpy as np
import pytest

from fba.persona import Persona, learn
from tools.persona.actors import Act, Style, act, all_contents

NAMES = ("E_HAPPY", "LFAU_27", "LFAU_18", "UFAU_2", "UFAU_43", "UFAU_4")
STYLE = Style(mouth=1.3, brows=1.4, lopsided=0.5)


@pytest.fixture(scope="session")
def actor() -> Act:
    """Four times each of six contents, about half a minute."""
    return act(all_contents(4, np.random.default_rng(5), NAMES), STYLE, seed=7, name="actor")


@pytest.fixture(scope="session")
def user() -> Act:
    return act([("E_HAPPY", 0.9), ("UFAU_43", 1.0), ("LFAU_27", 0.8)], seed=99, name="user")


@pytest.fixture(scope="session")
def persona(actor: Act) -> Persona:
    return learn([actor.face])
