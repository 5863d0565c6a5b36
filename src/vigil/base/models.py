"""Base class of the models of data that files and records hold."""

from pydantic import BaseModel, ConfigDict


class FrozenModel(BaseModel):
    """A model that cannot be changed. It refuses fields that it does not declare, and numbers that are NaN or
    infinite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
