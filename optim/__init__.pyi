from .problem.checks import DataError as DataError, DesignError as DesignError
from .identification.identify import identify as identify
from stickslip.lab.posterior.model_choice import (
    ChoiceStatus as ChoiceStatus,
    ModelChoice as ModelChoice,
    ModelEvidence as ModelEvidence,
    compare_models as compare_models,
)
from stickslip.lab.posterior.posterior import posterior as posterior
from stickslip.lab.posterior.reassemblies import (
    Population as Population,
    ReassemblyStatus as ReassemblyStatus,
    reassemblies as reassemblies,
)
from stickslip.lab.posterior.posterior_result import (
    Marginal as Marginal,
    Posterior as Posterior,
    PosteriorStatus as PosteriorStatus,
)
from stickslip.lab.posterior.sampling import Sampling as Sampling
from .identification.identification_result import (
    Identification as Identification,
    IdentifyStatus as IdentifyStatus,
)
from .problem.cases import Case as Case
from .problem.design_problem import Limit as Limit
from .results.design_result import DesignResult as DesignResult, DesignStatus as DesignStatus
from .results.design_result import CatalogueOption as CatalogueOption, OptionStatus as OptionStatus
from .robust.robust_result import RobustResult as RobustResult, RobustStatus as RobustStatus
from .robust.robust_design import robust_design as robust_design
from .search import design as design
from .studies.campbell import campbell_diagram as campbell_diagram, forbidden_hz as forbidden_hz
from stickslip.lab.catalogue.catalogue import CatalogueResult as CatalogueResult, catalogue as catalogue
from .results.studies_result import CampbellDiagram as CampbellDiagram, CampbellStatus as CampbellStatus
from .studies.elasticities import sensitivities as sensitivities
from .studies.pareto import pareto_front as pareto_front
from .results.studies_result import ParetoResult as ParetoResult, ParetoStatus as ParetoStatus
from .results.studies_result import (
    SensitivityResult as SensitivityResult,
    SensitivityStatus as SensitivityStatus,
)
from stickslip.lab.widget.explorer import explore as explore
