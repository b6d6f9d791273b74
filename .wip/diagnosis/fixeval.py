import sys,json,numpy as np
sys.path.insert(0,__file__.rsplit('/',1)[0] or '.')
import learn as L
cs=L.load('/tmp/e9-st','/tmp/st72')+L.load('/tmp/e9-own','/tmp/own48')
import io,contextlib
def ev(name,mu_a,s_a,mu_k,s_k,mu_o,s_o,s_w,T,eff,oth):
    p=np.array([np.log(mu_a),np.log(s_a),np.log(mu_k),np.log(s_k),np.log(mu_o),np.log(s_o),np.log(s_w),np.log(T),eff,oth])
    f=io.StringIO()
    with contextlib.redirect_stdout(f): L.report(cs,p)
    out=f.getvalue().split('\n'); o=[x for x in out if x.startswith(('own','st','conf'))]
    v=np.mean([-np.log(.03+.97*q) for q in [L.ptrue(c,p) for c in cs] if q is not None])
    print('%-14s'%name,'obj %.3f'%v,' | '.join(x.replace('single','s').replace('outside','o') for x in o))
    return out
ev('w2',1.1,.69,.15,.5,.4,.5,.22,.055,-5.4,-1.0)
ev('k.1',1.1,.69,.1,.5,.4,.5,.22,.055,-5.4,-1.0)
ev('k.1.7',1.1,.69,.1,.7,.4,.5,.22,.055,-5.4,-1.0)
ev('k.05.8',1.1,.69,.05,.8,.4,.5,.22,.055,-5.4,-1.0)
ev('a.7',.7,.69,.1,.5,.4,.5,.22,.055,-5.4,-1.0)
ev('o-1.5',1.1,.69,.1,.5,.5,.5,.22,.055,-5.4,-1.5)
ev('T.07',1.1,.69,.1,.5,.4,.5,.22,.07,-5.4,-1.0)
o=ev('eff6',1.1,.69,.1,.5,.4,.5,.22,.055,-6.4,-1.0)
