from optim import *
from service.client.client import Client as Client
from service.errors import ServiceProblem as ServiceProblem
from solver import *

__version__: str
