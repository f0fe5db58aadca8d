from optim import (
    DataError as DataError,
    DesignError as DesignError,
)
from service.errors import ServiceProblem as ServiceProblem
from solver import (
    Issue as Issue,
    MissingExtraError as MissingExtraError,
    ResultFileError as ResultFileError,
    SceneError as SceneError,
    SettingError as SettingError,
    SolverError as SolverError,
    StoppedError as StoppedError,
)
