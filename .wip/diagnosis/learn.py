import json,glob,os,sys,numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp
def load(b,s):
    out=[]
    for f in sorted(glob.glob(f'{b}/*.json')):
        n=os.path.basename(f)[:-5]; L=json.load(open(f'{s}/labels/{n}.json'))
        try: B=json.load(open(f))
        except Exception: continue
        if not B['sets']: continue
        c=dict(n=n,src=s,kind=L['kind'],truth=frozenset(e['id'] for e in L['effects']),gap=L.get('gap_over_floor') or L['gap_over_noise'],added=L.get('added_over_floor') or L['added_over_noise'],L=L,B=B)
        out.append(c)
    return out
NAMES=['mu_a','ls_a','mu_o','ls_o','mu_k','ls_k','ls_w','ltemper','eff','oth']
P0=np.array([0.0,np.log(.7),np.log(8),np.log(.9),np.log(.12),np.log(.5),np.log(.7),np.log(.4),-3.4,-2.0])
def posts(c,p,moves_min=0.4):
    mu_a,ls_a,mu_o,ls_o,mu_k,ls_k,ls_w,lt,eff,oth=p
    t=np.exp(lt); rows=[]
    for s in c['B']['sets']:
        cells=np.array(s['cells'],dtype=float)
        if len(cells)==0: continue
        la,lk,lw,ld=np.log(cells[:,0]),np.log(cells[:,1]),np.log(cells[:,2]),cells[:,3]
        k=len(s['effects'])
        def pr(x,mu,ls): return -0.5*((x-mu)/np.exp(ls))**2
        def nrm(x,mu,ls):
            g=np.unique(x); q=pr(g,mu,ls); return pr(x,mu,ls)-logsumexp(q)
        base=t*ld+nrm(lw,0,ls_w)+(nrm(lk,mu_k,ls_k) if k else 0)
        mine=logsumexp(base+nrm(la,mu_a,ls_a))+eff*k
        other=logsumexp(base+nrm(la,mu_o,ls_o))+eff*k+oth
        rows.append((frozenset(s['effects']),mine,other,s))
    return rows
def probs(c,p,moves_min=0.0):
    r=posts(c,p); al=np.array([[x[1],x[2]] for x in r]); z=logsumexp(al)
    return [(x[0],np.exp(x[1]-z),np.exp(x[2]-z),x[3]) for x in r]
def ptrue(c,p):
    pr=probs(c,p)
    if c['kind']=='outside': return sum(x[2] for x in pr)
    T=c['truth'] if c['gap']>=1.5 else None
    if T is None: return None
    return sum(x[1] for x in pr if x[0]==T)
def obj(p,cs):
    v=0;n=0
    for c in cs:
        q=ptrue(c,p)
        if q is None: continue
        v-=np.log(0.02+0.98*q); n+=1
    return v/n+0.01*np.sum((p-P0)**2/np.array([1,.5,1,.5,1,.5,.5,.5,4,4])**2)
if __name__=='__main__':
    cs=sum([load(a,b) for a,b in [x.split(':') for x in sys.argv[1:]]],[])
    print(len(cs),'cases', {k:sum(c['kind']==k for c in cs) for k in ['none','single','pair','outside']})
    p=P0
    print('start',obj(p,cs))
    r=minimize(obj,p,args=(cs,),method='Powell',options=dict(maxiter=6,xtol=1e-2,ftol=1e-3)); p=r.x
    print('end',r.fun); 
    for n,x in zip(NAMES,p): print(n, round(float(np.exp(x)) if n not in('eff','oth') else float(x),3))
    json.dump(list(map(float,p)),open('/tmp/prior.json','w'))
    for c in cs:
        pr=sorted(probs(c,p),key=lambda x:-x[1]-x[2]); q=ptrue(c,p)
        other=sum(x[2] for x in pr)
        top=pr[0]
        print(c['n'],c['kind'][:6],'gap %.1f'%c['gap'],'q',None if q is None else round(q,2),'other %.2f'%other,'T',sorted(c['truth']),'| top',sorted(top[0]),'%.2f/%.2f'%(top[1],top[2]),'mv %.1f'%top[3]['moves'][0],'sh %.2f'%top[3]['shrink'],'wst %.1f'%top[3]['worst'], '| 2nd',sorted(pr[1][0]) if len(pr)>1 else '', c['L']['stranger']['sensors']['filter'] if c['L'].get('stranger') else '')
