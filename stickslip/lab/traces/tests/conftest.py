"""What tests of the service share."""

from tests.service.conftest import *  # noqa: F403
