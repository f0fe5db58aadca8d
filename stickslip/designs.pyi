from optim import (
    CatalogueOption as CatalogueOption,
    CatalogueResult as CatalogueResult,
    DesignStatus as DesignStatus,
    OptionStatus as OptionStatus,
    ParetoResult as ParetoResult,
    ParetoStatus as ParetoStatus,
    RobustResult as RobustResult,
    RobustStatus as RobustStatus,
    SensitivityResult as SensitivityResult,
    SensitivityStatus as SensitivityStatus,
    catalogue as catalogue,
)
from solver import (
    AllowedExcitation as AllowedExcitation,
    AmplitudeHessian as AmplitudeHessian,
    Gradient as Gradient,
    MarginDiagram as MarginDiagram,
    MarginStatus as MarginStatus,
    Sensitivities as Sensitivities,
    margin_diagram as margin_diagram,
)
